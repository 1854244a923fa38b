/* The thesis' drive (equations.h) handed to SUNDIALS 6, as a C program would call it: right-hand
 * side and loop over the outputs are compiled; no Python in between. Built by
 * ../beside/sundials_peer.py.
 */
#include <stdlib.h>
#include <string.h>

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "equations.h"

#define MOST_STEPS 10000000

enum method { ADAMS, ADAMS_NEWTON, BDF, ERK, ERK_TO_OUTPUTS };

struct peer {
  struct drive drive;
  enum method method;
  long evaluations;
  SUNContext context;
  N_Vector y, absolute;
  void *memory;
  SUNNonlinearSolver iteration;
  SUNLinearSolver linear;
  SUNMatrix jacobian;
};

static int right_hand_side(realtype time, N_Vector y, N_Vector slope, void *data) {
  struct peer *peer = data;
  double A[2];
  peer->evaluations++;
  derivatives(&peer->drive, time, N_VGetArrayPointer(y), N_VGetArrayPointer(slope), A);
  return 0;
}

static int open_cvode(struct peer *p, double relative) {
  p->memory = CVodeCreate(p->method == BDF ? CV_BDF : CV_ADAMS, p->context);
  if (!p->memory) return -1;
  int bad = CVodeInit(p->memory, right_hand_side, 0.0, p->y);
  bad |= CVodeSetUserData(p->memory, p);
  bad |= CVodeSVtolerances(p->memory, relative, p->absolute);
  bad |= CVodeSetMaxNumSteps(p->memory, MOST_STEPS);
  if (p->method == ADAMS) { /* needs no Jacobian */
    p->iteration = SUNNonlinSol_FixedPoint(p->y, 0, p->context);
    bad |= CVodeSetNonlinearSolver(p->memory, p->iteration);
  } else { /* Newton's method, its Jacobian by differences */
    p->jacobian = SUNDenseMatrix(STATES, STATES, p->context);
    p->linear = SUNLinSol_Dense(p->y, p->jacobian, p->context);
    bad |= CVodeSetLinearSolver(p->memory, p->linear, p->jacobian);
  }
  return bad;
}

/* Fehlberg's pair of orders 7 and 8, and the slope at the step's end as one more stage, which the
 * next step begins with. Without it ERKStep before 6.6.1 takes the pair's own last stage for that
 * slope, because it is at the end too, and its steps are wrong (llnl/sundials issue 311). */
static int set_fehlberg(void *memory) {
  ARKodeButcherTable pair = ARKodeButcherTable_LoadERK(ARKODE_FEHLBERG_13_7_8);
  if (!pair) return -1;
  const int s = pair->stages;
  ARKodeButcherTable table = ARKodeButcherTable_Alloc(s + 1, 1);
  if (!table) return -1;
  table->q = pair->q;
  table->p = pair->p;
  for (int i = 0; i < s; i++) {
    memcpy(table->A[i], pair->A[i], s * sizeof(double));
    table->c[i] = pair->c[i];
    table->b[i] = table->A[s][i] = pair->b[i];
    table->d[i] = pair->d[i];
  }
  table->c[s] = 1.0;
  int bad = ERKStepSetTable(memory, table);
  ARKodeButcherTable_Free(pair);
  ARKodeButcherTable_Free(table);
  return bad;
}

static int open_erkstep(struct peer *p, double relative) {
  p->memory = ERKStepCreate(right_hand_side, 0.0, p->y, p->context);
  if (!p->memory) return -1;
  int bad = ERKStepSetUserData(p->memory, p);
  bad |= ERKStepSVtolerances(p->memory, relative, p->absolute);
  bad |= ERKStepSetMaxNumSteps(p->memory, MOST_STEPS);
  bad |= set_fehlberg(p->memory);
  bad |= ERKStepSetInterpolantDegree(p->memory, 5); /* the most there is */
  return bad;
}

void peer_close(struct peer *p) {
  if (!p) return;
  if (p->memory && p->method <= BDF) CVodeFree(&p->memory);
  if (p->memory && p->method >= ERK) ERKStepFree(&p->memory);
  if (p->iteration) SUNNonlinSolFree(p->iteration);
  if (p->linear) SUNLinSolFree(p->linear);
  if (p->jacobian) SUNMatDestroy(p->jacobian);
  if (p->y) N_VDestroy(p->y);
  if (p->absolute) N_VDestroy(p->absolute);
  SUNContext_Free(&p->context);
  free(p);
}

/* NULL: SUNDIALS refused. */
struct peer *peer_open(int method, const struct drive *drive, double relative,
                       const double *absolute) {
  struct peer *p = calloc(1, sizeof *p);
  if (!p) return NULL;
  p->drive = *drive;
  p->method = method;
  int bad = SUNContext_Create(NULL, &p->context);
  if (!bad) {
    p->y = N_VNew_Serial(STATES, p->context);
    p->absolute = N_VNew_Serial(STATES, p->context);
    N_VConst(0.0, p->y);
    memcpy(N_VGetArrayPointer(p->absolute), absolute, STATES * sizeof(double));
    bad = method <= BDF ? open_cvode(p, relative) : open_erkstep(p, relative);
  }
  if (!bad) return p;
  peer_close(p);
  return NULL;
}

/* Integrates while the acceleration is constant, from the first of the times, counted from where
 * the speed was start_speed, to the last; states has a row for each. Negative: SUNDIALS gave up. */
int peer_leg(struct peer *p, double start_speed, double slope, const double *times, long count,
             const double *start, double *states) {
  double *y = N_VGetArrayPointer(p->y), reached;
  int done = 0;
  p->drive.start_speed = start_speed;
  p->drive.slope = slope;
  memcpy(y, start, STATES * sizeof(double));
  memcpy(states, start, STATES * sizeof(double));
  if (p->method <= BDF) {
    done = CVodeReInit(p->memory, times[0], p->y);
    if (done >= 0) done = CVodeSetStopTime(p->memory, times[count - 1]);
  } else {
    done = ERKStepReInit(p->memory, right_hand_side, times[0], p->y);
    if (done >= 0) done = ERKStepSetStopTime(p->memory, times[count - 1]);
  }
  for (long i = 1; i < count && done >= 0; i++) {
    if (p->method <= BDF) {
      done = CVode(p->memory, times[i], p->y, &reached, CV_NORMAL);
    } else {
      if (p->method == ERK_TO_OUTPUTS) ERKStepSetStopTime(p->memory, times[i]);
      done = ERKStepEvolve(p->memory, times[i], p->y, &reached, ARK_NORMAL);
    }
    memcpy(states + i * STATES, y, STATES * sizeof(double));
  }
  return done;
}

/* Since the last call. */
long peer_evaluations(struct peer *p) {
  long made = p->evaluations;
  p->evaluations = 0;
  return made;
}
