/* @MADE_BY@
 *
 * @TITLE@ As a co-simulation FMU of FMI 3.0: the functions of the standard, by those of drive.h.
 *
 * Functions have their plain names, as a shared library needs them. To link several FMUs statically,
 * define FMI3_FUNCTION_PREFIX as @IDENTIFIER@_ when this file is compiled.
 */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drive.h"
#include "fmi3Functions.h"

#define TOKEN "@TOKEN@"
/* Tolerance of a communication point [s]: times that an importer adds up drift by rounding. */
#define TOLERANCE(time) (0.1 * DRIVE_STEP + 1e-12 * fabs(time))

enum mode { INSTANTIATED, INITIALIZATION, STEP, TERMINATED };

/* State that fmi3GetFMUState copies. */
struct fmu_state {
    enum mode mode;
    struct drive drive;
    int changed; /* parameters were set, so that outputs must be updated */
    double start_time; /* s */
    double time; /* s */
    double speed_command; /* rad/s */
    double acceleration; /* rad/s^2, towards a commanded speed */
    double whirl; /* m */
    double tilt[3]; /* rad; for a deck in space */
    bool follow_profile;
};

struct fmu {
    struct fmu_state state;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int warned; /* a warning on drifting times was logged */
};

struct variable {
    fmi3ValueReference reference;
    int settable; /* 0: never, 1: until initialized, 2: always */
    size_t place; /* offset in struct fmu_state */
    double least; /* least value that may be set */
};

#define AT(member) offsetof(struct fmu_state, member)

/* In the order of their value references; all are Float64 except follow_profile. */
static const struct variable variables[] = {
@VARIABLES@};
enum { VARIABLES = sizeof variables / sizeof variables[0], FOLLOW_PROFILE = @FOLLOW_PROFILE@ };

/* Log a text if the importer has a callback for it; return the status. */
static fmi3Status report(const struct fmu *fmu, fmi3Status status, const char *text)
{
    if (fmu->log)
        fmu->log(fmu->environment, status, "logStatusError", text);
    return status;
}

static fmi3Status unsupported(fmi3Instance instance, const char *name)
{
    char text[160];
    if (!instance)
        return fmi3Error;
    snprintf(text, sizeof text, "%s: is not supported by this FMU", name);
    return report(instance, fmi3Error, text);
}

/* Return whether the FMU is in one of two modes; log an error otherwise. */
static int is_in(const struct fmu *fmu, enum mode one, enum mode other, const char *name)
{
    char text[160];
    if (fmu->state.mode == one || fmu->state.mode == other)
        return 1;
    snprintf(text, sizeof text, "%s: must not be called in this state of the FMU", name);
    report(fmu, fmi3Error, text);
    return 0;
}

/* Update the outputs after parameters were set. */
static void refresh(struct fmu_state *state)
{
    struct drive *d = &state->drive;
    if (state->changed) {
        if (state->mode == INSTANTIATED || state->mode == INITIALIZATION)
            drive_reset(d);
        else
            drive_update(d);
        state->changed = 0;
    }
    state->time = state->start_time + drive_time(d);
    state->whirl = drive_whirl(d);
@if quaternion
    drive_tilt(d, state->tilt);
@end
}

/* Set the start state of the scene. */
static void initialise(struct fmu_state *state)
{
    memset(state, 0, sizeof *state);
    drive_init(&state->drive);
    state->speed_command = state->drive.out.speed;
    state->acceleration = DRIVE_MAX_ACCELERATION;
    refresh(state);
}

/* ---- Instances and their modes. */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count,
                               const fmi3String categories[])
{
    (void)on, (void)count, (void)categories; /* only errors are logged, and always */
    return instance ? fmi3OK : fmi3Error;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t intermediate_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    struct fmu initial = {.environment = environment, .log = log}, *fmu;
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return;
    (void)intermediate, (void)intermediate_count, (void)update;
    if (!token || strcmp(token, TOKEN) != 0) {
        report(&initial, fmi3Error, "the instantiationToken is not that of this FMU: " TOKEN);
        return NULL;
    }
    if (event_mode) {
        report(&initial, fmi3Error, "it has no event mode");
        return NULL;
    }
    fmu = malloc(sizeof *fmu);
    if (!fmu) {
        report(&initial, fmi3Error, "out of memory");
        return NULL;
    }
    *fmu = initial;
    initialise(&fmu->state);
    return fmu;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start_time,
                                       fmi3Boolean has_stop_time, fmi3Float64 stop_time)
{
    struct fmu *fmu = instance;
    (void)has_tolerance, (void)tolerance, (void)has_stop_time, (void)stop_time;
    if (!fmu || !is_in(fmu, INSTANTIATED, INSTANTIATED, "fmi3EnterInitializationMode"))
        return fmi3Error;
    if (!isfinite(start_time))
        return report(fmu, fmi3Error, "startTime: must be a finite number [s]");
    fmu->state.start_time = start_time;
    fmu->state.mode = INITIALIZATION;
    refresh(&fmu->state);
    return fmi3OK;
}

/* Pass speed_command and acceleration to the drive, unless it follows the profile. */
static fmi3Status apply_command(struct fmu *fmu)
{
    struct fmu_state *state = &fmu->state;
    char text[240];
    if (state->follow_profile ||
        drive_command_ramp(&state->drive, state->speed_command, state->acceleration) == DRIVE_OK)
        return fmi3OK;
    snprintf(text, sizeof text,
             "speed_command = %.17g rad/s, acceleration = %.17g rad/s^2: must be within +-%g, and "
             "above 0 and at most %g; the previous command stays in force",
             state->speed_command, state->acceleration, DRIVE_MAX_SPEED, DRIVE_MAX_ACCELERATION);
    return report(fmu, fmi3Warning, text);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    struct fmu *fmu = instance;
    fmi3Status status;
    if (!fmu || !is_in(fmu, INITIALIZATION, INITIALIZATION, "fmi3ExitInitializationMode"))
        return fmi3Error;
    refresh(&fmu->state);
    fmu->state.mode = STEP;
    if (fmu->state.follow_profile)
        drive_follow_profile(&fmu->state.drive);
    status = apply_command(fmu);
    refresh(&fmu->state);
    return status;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    struct fmu *fmu = instance;
    if (!fmu || !is_in(fmu, STEP, STEP, "fmi3Terminate"))
        return fmi3Error;
    fmu->state.mode = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    struct fmu *fmu = instance;
    if (!fmu)
        return fmi3Error;
    initialise(&fmu->state);
    return fmi3OK;
}

/* ---- Steps. */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 now, fmi3Float64 size,
                      fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *last)
{
    struct fmu *fmu = instance;
    struct fmu_state *state;
    fmi3Status status;
    double rounding, until, steps, offset;
    char text[240];
    (void)no_return;
    if (!fmu || !is_in(fmu, STEP, STEP, "fmi3DoStep"))
        return fmi3Error;
    if (!event || !terminate || !early || !last)
        return report(fmu, fmi3Error, "fmi3DoStep: a pointer for a result is NULL");
    state = &fmu->state;
    refresh(state);
    *event = *terminate = *early = false;
    *last = state->time;
    /* The FMU counts time itself. Times that an importer adds up drift from them by rounding. */
    if (!(fabs(now - state->time) <= TOLERANCE(now))) {
        snprintf(text, sizeof text, "currentCommunicationPoint = %.17g s: the FMU is at %.17g s",
                 now, state->time);
        return report(fmu, fmi3Error, text);
    }
    if (!fmu->warned && fabs(now - state->time) > 1e-6 * DRIVE_STEP + 1e-12 * fabs(now)) {
        fmu->warned = 1;
        snprintf(text, sizeof text,
                 "currentCommunicationPoint = %.17g s: the FMU is at %.17g s, and continues from "
                 "there; compute times as products, not as sums", now, state->time);
        report(fmu, fmi3Warning, text);
    }
    /* Whole steps, the same as those of drive_step alone, and a part of one if the end is between
     * two steps. */
    rounding = 1e-9 * DRIVE_STEP + 4.0 * DBL_EPSILON * (fabs(now) + size);
    until = state->drive.offset + size;
    steps = round(until / DRIVE_STEP);
    offset = 0.0;
    if (!(size > 0.0 && steps < 1e9)) {
        snprintf(text, sizeof text,
                 "communicationStepSize = %.17g s: must be above 0 and below %g s", size,
                 1e9 * DRIVE_STEP);
        return report(fmu, fmi3Error, text);
    }
    if (fabs(steps * DRIVE_STEP - until) > rounding) {
        steps = floor(until / DRIVE_STEP);
        offset = until - steps * DRIVE_STEP;
    }
    status = apply_command(fmu);
    if (drive_step(&state->drive, (long)steps) == DRIVE_DIVERGED ||
        (offset > 0.0 && drive_step_part(&state->drive, offset) == DRIVE_DIVERGED)) {
        refresh(state);
        *last = state->time;
        return report(fmu, fmi3Error,
                      "the drive went beyond all bounds: a parameter is too large, or too stiff "
                      "for the step");
    }
    refresh(state);
    *last = now + size;
    return status;
}

/* ---- Variables. */

/* Return the variable with a reference; log an error and return NULL if there is none. */
static const struct variable *variable_at(const struct fmu *fmu, fmi3ValueReference reference)
{
    char text[80];
    if (reference < VARIABLES)
        return &variables[reference]; /* they are numbered from 0 on */
    snprintf(text, sizeof text, "valueReference %lu: is not defined", (unsigned long)reference);
    report(fmu, fmi3Error, text);
    return NULL;
}

/* Check the arguments of a function that gets or sets values. */
static fmi3Status check(const struct fmu *fmu, const void *references, size_t count,
                        const void *values, size_t size)
{
    if (size != count || (count && (!references || !values)))
        return report(fmu, fmi3Error,
                      "nValues: must be nValueReferences, all variables are scalars");
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[],
                          size_t count, fmi3Float64 values[], size_t size)
{
    struct fmu *fmu = instance;
    if (!fmu || check(fmu, references, count, values, size) != fmi3OK)
        return fmi3Error;
    refresh(&fmu->state);
    for (size_t k = 0; k < count; k++) {
        const struct variable *v = variable_at(fmu, references[k]);
        if (!v || v->reference == FOLLOW_PROFILE)
            return fmi3Error;
        memcpy(&values[k], (const char *)&fmu->state + v->place, sizeof values[k]);
    }
    return fmi3OK;
}

/* Return whether a variable may be set now; log an error otherwise. */
static int may_set(const struct fmu *fmu, const struct variable *v)
{
    const int early = fmu->state.mode == INSTANTIATED || fmu->state.mode == INITIALIZATION;
    char text[120];
    if (fmu->state.mode != TERMINATED && (v->settable == 2 || (v->settable == 1 && early)))
        return 1;
    snprintf(text, sizeof text, "valueReference %lu: cannot be set, or not any more",
             (unsigned long)v->reference);
    report(fmu, fmi3Error, text);
    return 0;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[],
                          size_t count, const fmi3Float64 values[], size_t size)
{
    struct fmu *fmu = instance;
    if (!fmu || check(fmu, references, count, values, size) != fmi3OK)
        return fmi3Error;
    for (size_t k = 0; k < count; k++) { /* all or none */
        const struct variable *v = variable_at(fmu, references[k]);
        if (!v || v->reference == FOLLOW_PROFILE || !may_set(fmu, v))
            return fmi3Error;
        if (!isfinite(values[k]))
            return report(fmu, fmi3Error, "a value that is set must be a finite number");
        if (values[k] < v->least) {
            char text[120];
            snprintf(text, sizeof text, "valueReference %lu: %.17g is below its min, %g",
                     (unsigned long)v->reference, values[k], v->least);
            return report(fmu, fmi3Error, text);
        }
    }
    for (size_t k = 0; k < count; k++) {
        const struct variable *v = &variables[references[k]];
        memcpy((char *)&fmu->state + v->place, &values[k], sizeof values[k]);
        if (v->place < AT(drive) + sizeof fmu->state.drive)
            fmu->state.changed = 1;
    }
    return fmi3OK;
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference references[],
                          size_t count, fmi3Boolean values[], size_t size)
{
    struct fmu *fmu = instance;
    if (!fmu || check(fmu, references, count, values, size) != fmi3OK)
        return fmi3Error;
    for (size_t k = 0; k < count; k++) {
        if (references[k] != FOLLOW_PROFILE)
            return report(fmu, fmi3Error, "valueReference: only follow_profile is a Boolean");
        values[k] = fmu->state.follow_profile;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference references[],
                          size_t count, const fmi3Boolean values[], size_t size)
{
    struct fmu *fmu = instance;
    if (!fmu || check(fmu, references, count, values, size) != fmi3OK)
        return fmi3Error;
    for (size_t k = 0; k < count; k++) {
        if (references[k] != FOLLOW_PROFILE)
            return report(fmu, fmi3Error, "valueReference: only follow_profile is a Boolean");
        if (!may_set(fmu, &variables[FOLLOW_PROFILE]))
            return fmi3Error;
        fmu->state.follow_profile = values[k];
    }
    return fmi3OK;
}

/* ---- The FMU's state: a plain copy. */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *saved)
{
    struct fmu *fmu = instance;
    if (!fmu || !saved)
        return fmi3Error;
    if (!*saved && !(*saved = malloc(sizeof fmu->state)))
        return report(fmu, fmi3Error, "out of memory");
    memcpy(*saved, &fmu->state, sizeof fmu->state);
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState saved)
{
    struct fmu *fmu = instance;
    if (!fmu || !saved)
        return fmi3Error;
    memcpy(&fmu->state, saved, sizeof fmu->state);
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *saved)
{
    if (!instance || !saved)
        return fmi3Error;
    free(*saved);
    *saved = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState saved, size_t *size)
{
    if (!instance || !saved || !size)
        return fmi3Error;
    *size = sizeof(struct fmu_state);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState saved, fmi3Byte bytes[],
                                 size_t size)
{
    if (!instance || !saved || !bytes || size != sizeof(struct fmu_state))
        return fmi3Error;
    memcpy(bytes, saved, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *saved)
{
    struct fmu *fmu = instance;
    if (!fmu || !bytes || !saved)
        return fmi3Error;
    if (size != sizeof(struct fmu_state))
        return report(fmu, fmi3Error, "a serialized state is not of this FMU: its size differs");
    if (!*saved && !(*saved = malloc(size)))
        return report(fmu, fmi3Error, "out of memory");
    memcpy(*saved, bytes, size);
    return fmi3OK;
}

/* ---- Functions of FMI that this FMU does not support. */

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log;
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log, (void)update, (void)lock, (void)unlock;
    return NULL;
}

@UNSUPPORTED@
