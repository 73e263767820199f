#!/bin/sh
# Installs the Debian packages of system.txt that are missing; without the right to do so, says the line to run.
set -eu
python=${1:?usage: system.sh PYTHON}
here=$(dirname "$0")

if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
  echo "padlab needs Python 3.11 or newer; '$python' is not. Give another one: make setup PYTHON=/path/to/python3.12" >&2
  exit 1
fi
wanted=$(sed -e 's/#.*//' "$here/system.txt" | xargs)
"$python" -c 'import ensurepip, venv' 2>/dev/null || wanted="$wanted python3-venv"

if ! command -v apt-get >/dev/null 2>&1; then
  echo "This is no Debian system: make sure yourself that EGL and OpenGL libraries and Chromium are there ($wanted)." >&2
  exit 0
fi
missing=
for package in $wanted; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

line="apt-get update && apt-get install -y --no-install-recommends$missing"
if [ "$(id -u)" = 0 ]; then
  as_root=
elif sudo -n true 2>/dev/null; then
  as_root="sudo -n env DEBIAN_FRONTEND=noninteractive"
else
  echo "These system packages are missing:$missing. Run this line, then make again:" >&2
  echo "  sudo sh -c '$line'" >&2
  exit 1
fi
echo "Installing system packages:$missing"
export DEBIAN_FRONTEND=noninteractive
log=$(mktemp)
if ! { $as_root apt-get update -qq && $as_root apt-get install -y -qq --no-install-recommends $missing; } >"$log" 2>&1; then
  tail -n 5 "$log" >&2
  echo "System packages could not be installed; run this line yourself, then make again: sudo sh -c '$line'" >&2
  exit 1
fi
rm -f "$log"
