# To be sourced: parts of a script that run side by side.
#   beside NAME COMMAND...   begins a part; what it prints is kept
#   join NAME...             waits for parts in turn, prints what each said, and ends the script where one failed
# Whatever ends the script ends the parts that still run.
say() { printf '\n== %s\n' "$*"; }

declare -A part
printed=$(mktemp -d)
trap 'for pid in "${part[@]}"; do kill -- "-$pid" 2>/dev/null || true; done; rm -rf "$printed"' EXIT

beside() {
  local name=$1
  shift
  set -m # a process group of its own, so that all of it can be ended
  "$@" > "$printed/${name//\//_}" 2>&1 < /dev/null &
  set +m
  part[$name]=$!
}

join() {
  local name code
  for name; do
    code=0
    wait "${part[$name]}" || code=$?
    say "$name"
    cat "$printed/${name//\//_}"
    if [ "$code" -ne 0 ]; then
      echo "$0: $name failed (exit code $code)" >&2
      exit "$code"
    fi
  done
}
