/* Start-up firmware without ROS: the same as ../firmware.py, over Eclipse Cyclone DDS.

   firmware [--adaptive] [NAMESPACE]: with --adaptive, the start-up of adaptive.h chooses the speed;
   it is given nothing about the drive except the final speed and the acceleration.

   A DDS client needs three conventions of ROS: "rt/" before a topic's name, the types of
   messages.idl, and the quality of service. docs/topics.md describes the topics. */
#define _POSIX_C_SOURCE 200809L
#include <dds/dds.h>
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "adaptive.h"
#include "messages.h"
#include "start_up.h"

#define PERIOD_NS 5000000 /* time between two commands [ns] */
#define DEPTH 10
#define AT_ONCE 32 /* largest number of samples taken from a reader at a tick */
#define FINAL_SPEED 200.0
#define RAMP 200.0 /* of the adaptive start-up [rad/s, rad/s^2]; below the drive's limits */

/* Discovery as in ROS 2 with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST, without multicast: contact the
   ports of this machine's participants. CYCLONEDDS_URI of the environment replaces this. */
static const char LOOPBACK[] =
    "<General><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    "<Peers><Peer Address=\"localhost\"/></Peers></Discovery>";

/* Cyclone DDS 0.10 also reads the type descriptions that ROS nodes request from each other. It
   crashes on those of sequences, as in JointState (ddsi_xt_type_add_typeobj, thread dq.builtins).
   Types are matched by name here (idlc -t), so descriptions are not needed. The dynamic linker uses
   this empty function instead of the library's. */
struct ddsi_domaingv;
struct ddsi_serdata;
__attribute__((visibility("default")))
void ddsi_tl_handle_reply(struct ddsi_domaingv *domain, struct ddsi_serdata *reply);
void ddsi_tl_handle_reply(struct ddsi_domaingv *domain, struct ddsi_serdata *reply)
{
    (void)domain;
    (void)reply;
}

static volatile sig_atomic_t interrupted;

static void interrupt(int number)
{
    interrupted = 1;
    signal(number, SIG_DFL); /* a second Ctrl-C exits while the spindle turns */
}

static void say(const char *line)
{
    puts(line);
    fflush(stdout);
}

/* The firmware's state: one of the two start-ups chooses the speed. */
struct firmware {
    struct start_up start_up;
    struct adaptive adaptive;
    bool is_adaptive;
    int said;
    double now;                     /* time since the start [s] */
    double time, angle, speed;      /* last sample of the spindle; time NaN: none yet */
};

static void spindle(struct firmware *f, double time, double angle, double speed)
{
    f->time = time;
    f->angle = angle;
    f->speed = speed;
    if (!f->is_adaptive)
        start_up_spindle(&f->start_up, time, angle, speed);
}

static void vibrates(struct firmware *f, double time, double x, double y)
{
    if (!f->is_adaptive)
        start_up_vibration(&f->start_up, time, x, y);
    else if (!isnan(f->time)) /* extrapolate the angle to the time of this sample */
        adaptive_sample(&f->adaptive, time, f->angle + f->speed * (time - f->time), f->speed, x, y);
}

static bool over(const struct firmware *f)
{
    return f->is_adaptive ? f->adaptive.state == ADAPTIVE_ABORTED : f->start_up.state == OFF;
}

static bool waits(const struct firmware *f)
{
    return f->is_adaptive ? f->adaptive.state == ADAPTIVE_WAITING : f->start_up.state == WAITING;
}

static void stop(struct firmware *f)
{
    if (!f->is_adaptive)
        start_up_stop(&f->start_up);
    else if (waits(f))
        f->adaptive.state = ADAPTIVE_ABORTED; /* never started */
    else
        adaptive_abort(&f->adaptive, f->now);
}

/* Return the speed to command [rad/s]; called once per period. */
static double tick(struct firmware *f, double passed)
{
    const struct adaptive *a = &f->adaptive;
    char line[240];
    double speed;
    if (!f->is_adaptive)
        return start_up_tick(&f->start_up, passed);
    f->now += passed;
    if (a->samples == 0)
        return 0.0; /* wait: once started, the controller aborts if samples cease */
    speed = adaptive_command(&f->adaptive, f->now);
    if (a->decisions != f->said) {
        f->said = a->decisions;
        snprintf(line, sizeof line,
                 "%s: critical speed %.1f +- %.1f rad/s, net unbalance %.3g um, dwell %d%s%s",
                 adaptive_state_text(a->state), a->critical, a->critical_deviation,
                 1e6 * hypot(a->re, a->im), a->dwells, a->reason ? ", " : "",
                 adaptive_reason_text(a->reason));
        say(line);
    }
    return speed;
}

static void init(struct firmware *f, bool is_adaptive)
{
    struct adaptive_settings settings = adaptive_defaults();
    memset(f, 0, sizeof *f);
    f->is_adaptive = is_adaptive;
    f->time = NAN;
    settings.final_speed = FINAL_SPEED;
    settings.acceleration = RAMP;
    settings.period = 1e-9 * PERIOD_NS;
    settings.quantity = ADAPTIVE_ACCELERATION;
    settings.axes = 2;
    adaptive_init(&f->adaptive, &settings);
    start_up_init(&f->start_up, &default_settings, say);
}

static dds_entity_t checked(dds_entity_t entity, const char *what)
{
    if (entity < 0) {
        fprintf(stderr, "firmware: %s: %s\n", what, dds_strretcode(entity));
        exit(2);
    }
    return entity;
}

static dds_entity_t topic_of(dds_entity_t participant, const char *prefix, const char *name,
                             const dds_topic_descriptor_t *type)
{
    char full[200];
    snprintf(full, sizeof full, "rt/%s%s%s", prefix, *prefix ? "/" : "", name);
    return checked(dds_create_topic(participant, type, full, NULL, NULL), full);
}

static double seconds(const builtin_interfaces_msg_dds__Time_ *stamp)
{
    return stamp->sec_ + 1e-9 * stamp->nanosec_;
}

static void hear_spindle(dds_entity_t reader, struct firmware *firmware)
{
    void *samples[AT_ONCE] = {NULL}; /* NULL: dds_take lends the reader's buffers */
    dds_sample_info_t infos[AT_ONCE];
    int count = dds_take(reader, samples, infos, AT_ONCE, AT_ONCE);
    for (int k = 0; k < count; k++) {
        const sensor_msgs_msg_dds__JointState_ *joints = samples[k];
        if (!infos[k].valid_data)
            continue;
        for (uint32_t i = 0; i < joints->name_._length; i++)
            if (!strcmp(joints->name_._buffer[i], "spindle") && i < joints->position_._length &&
                i < joints->velocity_._length)
                spindle(firmware, seconds(&joints->header_.stamp_), joints->position_._buffer[i],
                        joints->velocity_._buffer[i]);
    }
    if (count > 0)
        dds_return_loan(reader, samples, count);
}

static void hear_vibration(dds_entity_t reader, struct firmware *firmware)
{
    /* Several accelerometers may share the topic: use the first one received. */
    static char sensor[100];
    void *samples[AT_ONCE] = {NULL};
    dds_sample_info_t infos[AT_ONCE];
    int count = dds_take(reader, samples, infos, AT_ONCE, AT_ONCE);
    for (int k = 0; k < count; k++) {
        const geometry_msgs_msg_dds__AccelStamped_ *accel = samples[k];
        if (!infos[k].valid_data)
            continue;
        if (!*sensor)
            snprintf(sensor, sizeof sensor, "%s", accel->header_.frame_id_);
        if (!strncmp(sensor, accel->header_.frame_id_, sizeof sensor - 1))
            vibrates(firmware, seconds(&accel->header_.stamp_), accel->accel_.linear_.x_,
                     accel->accel_.linear_.y_);
    }
    if (count > 0)
        dds_return_loan(reader, samples, count);
}

/* Sleep until the deadline, advance it beyond now, and return the number of periods that passed. */
static int next_tick(struct timespec *deadline)
{
    struct timespec now;
    int periods = 0;
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, deadline, NULL) == EINTR)
        ;
    clock_gettime(CLOCK_MONOTONIC, &now);
    /* A late tick counts as all the periods that have passed. */
    do {
        periods++;
        deadline->tv_nsec += PERIOD_NS;
        if (deadline->tv_nsec >= 1000000000) {
            deadline->tv_nsec -= 1000000000;
            deadline->tv_sec++;
        }
    } while (deadline->tv_sec < now.tv_sec ||
             (deadline->tv_sec == now.tv_sec && deadline->tv_nsec <= now.tv_nsec));
    return periods;
}

/* Return the domain as in ROS: ROS_DOMAIN_ID, or 0. */
static dds_domainid_t domain_of_ros(void)
{
    const char *text = getenv("ROS_DOMAIN_ID");
    char *end;
    unsigned long domain;
    if (text == NULL || !*text)
        return 0;
    domain = strtoul(text, &end, 10);
    if (*end || domain > 232) {
        fprintf(stderr, "firmware: ROS_DOMAIN_ID = %s: must be a number from 0 to 232\n", text);
        exit(2);
    }
    return (dds_domainid_t)domain;
}

int main(int count, char **arguments)
{
    bool is_adaptive = count > 1 && !strcmp(arguments[1], "--adaptive");
    const char *prefix = count > 1 + is_adaptive ? arguments[1 + is_adaptive] : "";
    struct firmware firmware;
    struct timespec deadline;
    dds_entity_t participant, command, joints, vibration;
    dds_qos_t *qos;

    if (count > 2 + is_adaptive || *prefix == '-' || *prefix == '/') {
        fprintf(stderr, "usage: firmware [--adaptive] [NAMESPACE]    (of the drive's topics, as in: "
                        "left)\n");
        return 2;
    }
    setenv("CYCLONEDDS_URI", LOOPBACK, 0);
    participant = checked(dds_create_participant(domain_of_ros(), NULL, NULL), "participant");
    qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, DEPTH);
    dds_entity_t command_topic = topic_of(participant, prefix, "spindle/command",
                                          &std_msgs_msg_dds__Float64__desc);
    dds_entity_t joints_topic = topic_of(participant, prefix, "joint_states",
                                         &sensor_msgs_msg_dds__JointState__desc);
    dds_entity_t vibration_topic = topic_of(participant, prefix, "vibration",
                                            &geometry_msgs_msg_dds__AccelStamped__desc);
    command = checked(dds_create_writer(participant, command_topic, qos, NULL), "writer");
    joints = checked(dds_create_reader(participant, joints_topic, qos, NULL), "reader");
    vibration = checked(dds_create_reader(participant, vibration_topic, qos, NULL), "reader");
    dds_delete_qos(qos);

    init(&firmware, is_adaptive);
    signal(SIGINT, interrupt);
    signal(SIGTERM, interrupt);
    say("waiting: for a drive");
    clock_gettime(CLOCK_MONOTONIC, &deadline);
    while (!over(&firmware)) {
        double passed = 1e-9 * PERIOD_NS * next_tick(&deadline);
        std_msgs_msg_dds__Float64_ message;
        if (interrupted)
            stop(&firmware);
        hear_spindle(joints, &firmware);
        hear_vibration(vibration, &firmware);
        message.data_ = tick(&firmware, passed);
        if (!waits(&firmware))
            dds_write(command, &message);
    }
    dds_delete(participant);
    return is_adaptive ? firmware.adaptive.reason > ADAPTIVE_REQUESTED : firmware.start_up.failed;
}
