"""Hide from ab_sim what Windows lacks; Python imports this file at its start.

Other packages see the real system, as they have other code for Windows.
"""

import builtins
import inspect
import os
import select
import signal
import socket
import sys
import time
import warnings

OURS = ("ab_sim", "ab_msgs_py")
MODULES = {
    *("fcntl", "grp", "posix", "pty", "pwd", "rclpy", "readline", "resource", "syslog"),
    *("termios", "tty"),
}
FILES = ("/dev/", "/proc/", "/sys/")
OF_OS = """
    O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_SYNC WNOHANG chown confstr ctermid environb
    fchdir fchmod fchown fdatasync fork forkpty fpathconf get_blocking getegid getenvb geteuid
    getgid getgroups getloadavg getpgid getpgrp getpriority getsid getuid getxattr killpg lchown
    listxattr lockf memfd_create mkfifo mknod nice openpty pathconf pidfd_open pipe2
    posix_fadvise posix_fallocate posix_spawn pread pwrite readv register_at_fork
    sched_getaffinity sched_setaffinity sched_setscheduler sched_yield sendfile set_blocking
    setgid setpgid setpriority setsid setuid setxattr statvfs sync sysconf tcgetpgrp tcsetpgrp
    ttyname uname wait wait3 wait4 waitid writev
"""
OF_SIGNAL = """
    SIGALRM SIGCHLD SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGUSR1 SIGUSR2 SIG_BLOCK SIG_SETMASK
    SIG_UNBLOCK alarm pause pthread_kill pthread_sigmask setitimer siginterrupt sigpending
    sigtimedwait sigwait
"""
OF_TIME = "CLOCK_BOOTTIME CLOCK_MONOTONIC clock_getres clock_gettime tzset"
LACKING = {
    os: {"name": "nt"} | dict.fromkeys(OF_OS.split()),
    select: {"poll": None, "epoll": None},
    signal: dict.fromkeys(OF_SIGNAL.split()),
    socket: {"SO_REUSEPORT": None, "send_fds": None},
    sys: {"platform": "win32"},
    time: dict.fromkeys(OF_TIME.split()),
}
"""Names in modules, with their values on Windows; None: missing there."""


def is_ours(name):
    return name.partition(".")[0] in OURS


def hide(module, lacking):
    real = {name: vars(module).pop(name) for name in lacking if name in vars(module)}

    def look_up(name):
        if name in real and not is_ours(
            inspect.currentframe().f_back.f_globals.get("__name__", "")
        ):
            return real[name]
        if lacking.get(name) is None:
            raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")
        return lacking[name]

    module.__getattr__ = look_up


def import_visible(name, globals=None, locals=None, fromlist=(), level=0):
    importer = (globals or {}).get("__name__", "")
    if is_ours(importer) and name.partition(".")[0] in MODULES:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return real_import(name, globals, locals, fromlist, level)


def refuse_files(event, arguments):
    if event == "open" and str(arguments[0]).startswith(FILES):
        frame = inspect.currentframe().f_back
        while frame and frame.f_globals.get("__name__", "").startswith("pathlib"):
            frame = frame.f_back
        if frame and is_ours(frame.f_globals.get("__name__", "")):
            raise FileNotFoundError(arguments[0])


real_import, builtins.__import__ = builtins.__import__, import_visible
for module, lacking in LACKING.items():
    hide(module, lacking)
sys.addaudithook(refuse_files)
# Text files are not UTF-8 by default; Python warns only with PYTHONWARNDEFAULTENCODING.
warnings.filterwarnings("ignore", category=EncodingWarning)
warnings.filterwarnings("error", category=EncodingWarning, module=r"ab_(sim|msgs_py)\b")
