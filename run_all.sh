#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# ./run_all.sh [OPTION…]   set up, then the main job: leo demo [OPTION…]
# ./run_all.sh test [ARG…] set up, then pytest [ARG…] on all cores, ruff and mypy beside it
# ./run_all.sh test-all    as test, with the tests marked slow too, and what they cover
# ./run_all.sh setup       only set up: .venv with the leo command, and the laboratory's verbs
#
# PYTHON=/path/to/python chooses the interpreter (3.11 or 3.12). A second run starts at once.

set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")"
trap 'echo "run_all.sh: interrupted; the next run goes on from here" >&2; exit 130' INT TERM

readonly VENV=.venv
readonly LOG=$VENV/setup.log
readonly LABORATORY=benchmarks/laboratory # no part of the product, which is src

die() {
  echo "run_all.sh: error: $*" >&2
  exit 2
}

usable() { # PYTHON: is it 3.11 or 3.12, and can it make environments? (a pyenv shim may not even start)
  "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] not in {(3, 11), (3, 12)})' \
    > /dev/null 2>&1
}

find_python() {
  local name candidate
  # With ROS sourced its own python3 comes first: rclpy is built for that one.
  for name in ${PYTHON:-${ROS_DISTRO:+python3} python3.11 python3.12 python3}; do
    for candidate in $(type -ap "$name"); do
      if usable "$candidate"; then
        echo "$candidate"
        return
      fi
    done
  done
  for candidate in "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.1[12].*/bin/python3; do
    if [[ -z ${PYTHON:-} ]] && usable "$candidate"; then
      echo "$candidate"
      return
    fi
  done
  die "no ${PYTHON:-Python 3.11 or 3.12} with the venv module found; install one" \
    "(Debian, Ubuntu: apt install python3-venv) or set PYTHON=/path/to/python3.11"
}

need_compiler() { # PYTHON: PyBullet ships a wheel for 3.11 on x86_64 and is compiled elsewhere
  [[ "$("$1" -c 'import sys; print(*sys.version_info[:2], sep=".")') $(uname -m)" \
    == '3.11 x86_64' ]] && return
  [[ -n "$(type -p "${CXX:-c++}" g++ clang++)" ]] ||
    die "no C++ compiler found, and PyBullet has to be compiled for this Python; install one" \
      "(Debian, Ubuntu: apt install g++ python3-dev) or use Python 3.11 on x86_64"
}

pip_install() {
  "$VENV/bin/python" -m pip install --disable-pip-version-check --no-input "$@" >> "$LOG" 2>&1 ||
    die "pip install failed; the reason is at the end of $PWD/$LOG: $(tail -n 1 "$LOG")"
}

other_python_wanted() {
  [[ -n ${PYTHON:-} && "$("$PYTHON" -V 2>&1)" != "$("$VENV/bin/python" -V)" ]]
}

ros() { # where rclpy comes from: the ROS that is sourced, wheels, or none; never two at once
  if [[ -n ${ROS_DISTRO:-} ]]; then
    echo "$ROS_DISTRO, sourced"
  elif [[ "$(uname -sm)" == 'Linux x86_64' ]]; then
    echo wheels
  else
    echo none
  fi
}

make_environment() {
  local python site=()
  python=$(find_python)
  need_compiler "$python"
  # RoboStack's rclpy lies beside its Python, that of apt on PYTHONPATH, which every Python reads.
  [[ -n ${ROS_DISTRO:-} && -n ${CONDA_PREFIX:-} ]] && site=(--system-site-packages)
  echo "setting up $PWD/$VENV with $python (some minutes, once)"
  "$python" -m venv --clear "${site[@]}" "$VENV"
  touch "$VENV/COLCON_IGNORE"
  ros > "$VENV/.ros"
}

fingerprint() { # what an installed environment depends on
  { pwd; ros; "$VENV/bin/python" -VV; cat constraints.txt "$@" src/*/{package.xml,setup.py,setup.cfg} "$LABORATORY/pyproject.toml"; } | cksum
}

install_ros() {
  case "$(ros)" in
    wheels)
      pip_install --constraint constraints.txt --requirement=requirements-ros.txt
      ;;
    none)
      echo "no ROS 2 here, so no nodes (leo run, leo topic, leo demo); the rest works. For these" \
        "install ROS 2 Jazzy (RoboStack has it for this platform), source it, set up again"
      ;;
    *)
      "$VENV/bin/python" -c 'import rclpy, sensor_msgs.msg' 2>> "$LOG" ||
        die "ROS $ROS_DISTRO is sourced, but $VENV/bin/python cannot import its rclpy and" \
          "sensor_msgs: set PYTHON to the Python of that ROS, or source none (see $PWD/$LOG)"
      ;;
  esac
}

link_packages() { # NAME…: what ros2 run and ros2 launch look for, which editable installs leave out
  local name share=$PWD/$VENV/share
  mkdir -p "$share/ament_index/resource_index/packages" "$VENV/lib"
  for name in "$@"; do
    ln -sf "$PWD/src/$name/resource/$name" "$share/ament_index/resource_index/packages/"
    ln -sfn "$PWD/src/$name" "$share/$name"
    [[ -d src/$name/scripts ]] && ln -sfn "$PWD/src/$name/scripts" "$VENV/lib/$name"
  done
  return 0
}

compile_all() { # once, by their first use; it is kept, and no command or test waits for it
  "$VENV/bin/python" -m compileall -q src
  "$VENV/bin/python" - << 'PYTHON'
import numpy as np

from leo_sim.model import Model
from leo_sim.model.batch import rollout

for robot in ('leo', 'pendulum'):
    model, inputs = Model(robot), np.zeros((1, 1, 6 if robot == 'leo' else 1))
    state = model.start()
    model.step(state, inputs[0, 0], 0.03)
    rollout(model, state.q[None], state.dq[None], inputs, 0.03)
PYTHON
  "$VENV/bin/leo" explain src/leo_learner/leo_learner/quick/bag --model torque_pendulum >> "$LOG" 2>&1 ||
    true # an open answer is status 1
}

setup() { # REQUIREMENTS…: install them, the four packages and the laboratory, unless that is done already
  local stamp=$VENV/.ready-${*: -1} packages=(leo_msgs_py leo_sim leo_diffmodel leo_learner)
  if ! usable "$VENV/bin/python" || other_python_wanted ||
    [[ "$(cat "$VENV/.ros" 2> /dev/null)" != "$(ros)" ]]; then
    make_environment
  fi
  [[ -f $stamp && "$(cat "$stamp")" == "$(fingerprint "$@")" ]] && return
  echo "installing ${*} (log: $LOG)"
  : > "$LOG"
  pip_install --constraint constraints.txt setuptools
  install_ros
  pip_install --constraint constraints.txt "${@/#/--requirement=}"
  pip_install --no-build-isolation --no-deps "${packages[@]/#/--editable=src/}" "--editable=$LABORATORY"
  link_packages "${packages[@]}"
  compile_all
  fingerprint "$@" > "$stamp"
}

lint() {
  echo 'ruff' && "$VENV/bin/python" -m ruff check . && "$VENV/bin/python" -m ruff format --check . &&
    echo 'mypy' && "$VENV/bin/python" -m mypy
}

run_tests() { # ARG…: pytest's; neither BLAS nor explain's second process takes another test's core
  local linted=0 tested=0
  lint > "$VENV/lint.log" 2>&1 &
  trap 'kill $! 2> /dev/null; exit 130' INT TERM
  OPENBLAS_NUM_THREADS=1 LOKY_MAX_CPU_COUNT=1 "$VENV/bin/python" -m pytest --numprocesses=auto "$@" || tested=$?
  wait $! || linted=$?
  cat "$VENV/lint.log"
  return $((linted > tested ? linted : tested))
}

export PATH="$PWD/$VENV/bin:$PATH"
case ${1:-} in
  setup)
    setup requirements.txt
    echo "ready: source $PWD/$VENV/bin/activate, then: leo --help"
    ;;
  test)
    setup requirements.txt requirements-test.txt
    run_tests -m 'not slow' "${@:2}"
    ;;
  test-all)
    setup requirements.txt requirements-test.txt
    run_tests --cov "${@:2}"
    ;;
  -h | --help)
    sed -n '4,9s/^# //p' run_all.sh
    ;;
  '' | -*)
    setup requirements.txt
    exec leo demo "$@"
    ;;
  *)
    die "no such command: $1; there are: setup, test, test-all, and none for the main job"
    ;;
esac
