# A machine on which `make demo` and `make test` run, without ROS of its own:
#
#     docker build --tag ab_sim .
#     docker run --rm --volume "$PWD/out:/ab_sim/out" ab_sim make demo
#     docker run --rm ab_sim make test
#
# Not built where it was written: that machine has no Docker daemon. It names what the two commands
# need on Debian 12, which is what they are run on there.
FROM debian:bookworm

# `make test` installs these by itself; here they come once, with the image. g++: the action. gcc: the
# firmware prototype in C. git: tests ask which files there are. iproute2: two hosts in one machine.
RUN apt-get update && \
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
        ca-certificates chromium cyclonedds-dev cyclonedds-tools g++ gcc git iproute2 libc6-dev \
        libgl1 libxkbcommon0 make python3 python3-dev python3-venv && \
    rm -rf /var/lib/apt/lists/*

WORKDIR /ab_sim

# .venv first: it changes less often than the rest.
COPY Makefile setup.py constraints*.txt package.xml pyproject.toml README.md LICENSE ./
COPY tools tools
COPY resource resource
COPY ab_sim/__init__.py ab_sim/__init__.py
COPY ab_msgs_py/__init__.py ab_msgs_py/__init__.py
RUN make .venv/dev.stamp

COPY . .
# What setup.py lists, launch files and scenes among it, is there only now.
RUN git config --global --add safe.directory /ab_sim && touch setup.py && make .venv/dev.stamp

CMD ["make", "help"]
