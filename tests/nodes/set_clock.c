/* A system clock that is set while a program runs: with LD_PRELOAD, for that program alone.
 *
 * SET_CLOCK names a file of one int64_t: nanoseconds by which CLOCK_REALTIME is ahead. Waits until
 * a time of that clock are cut up, so that they see it when the clock is set, as the kernel's do. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define SLICE 10000000LL /* ns */

static volatile int64_t *ahead(void)
{
    static volatile int64_t *kept, none;
    const char *name = getenv("SET_CLOCK");
    if (!kept && name) {
        const int file = open(name, O_RDONLY);
        void *found = mmap(NULL, sizeof none, PROT_READ, MAP_SHARED, file, 0);
        kept = found == MAP_FAILED ? &none : found;
    }
    return kept ? kept : &none;
}

static int64_t nanoseconds(const struct timespec *t)
{
    return t->tv_sec * SECOND + t->tv_nsec;
}

static struct timespec timespec_of(int64_t t)
{
    return (struct timespec){t / SECOND, t % SECOND};
}

static int64_t by_kernel(void)
{
    struct timespec t;
    syscall(SYS_clock_gettime, CLOCK_REALTIME, &t);
    return nanoseconds(&t);
}

int clock_gettime(clockid_t clock, struct timespec *t)
{
    const long result = syscall(SYS_clock_gettime, clock, t);
    if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *t = timespec_of(nanoseconds(t) + *ahead());
    return (int)result;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone)
{
    (void)zone;
    const int64_t now = by_kernel() + *ahead();
    *t = (struct timeval){now / SECOND, now % SECOND / 1000};
    return 0;
}

time_t time(time_t *t)
{
    const time_t now = (by_kernel() + *ahead()) / SECOND;
    if (t)
        *t = now;
    return now;
}

/* The end of the next slice of a wait, by the kernel's clock; whether it is the last one. */
static int slice(const struct timespec *end, struct timespec *until)
{
    const int64_t now = by_kernel(), left = nanoseconds(end) - *ahead() - now;
    *until = timespec_of(now + (left < SLICE ? left : SLICE));
    return left < SLICE;
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict end)
{
    static int (*wait)(sem_t *, const struct timespec *);
    if (!wait)
        *(void **)&wait = dlsym(RTLD_NEXT, "sem_timedwait");
    for (;;) {
        struct timespec until;
        const int last = slice(end, &until), result = wait(semaphore, &until);
        if (result == 0 || errno != ETIMEDOUT || last)
            return result;
    }
}

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict end)
{
    static int (*wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    if (!wait)
        *(void **)&wait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (nanoseconds(end) < by_kernel() / 2) /* by the steady clock */
        return wait(condition, mutex, end);
    for (;;) {
        struct timespec until;
        const int last = slice(end, &until), result = wait(condition, mutex, &until);
        if (result != ETIMEDOUT || last)
            return result;
    }
}
