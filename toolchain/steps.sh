# shellcheck shell=bash
# Sourced by tools/run, tools/test and toolchain/checks/*: steps that stay quiet while all is well.
# A step's output goes to a log; its progress is shown, and on failure the part of the log that matters.

unset CDPATH # with it `cd` may go elsewhere, and prints where
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export LANG=C.UTF-8 LC_ALL=C.UTF-8 # a compiler's cache tells both from none
# Where ccache is there, clones in different places share what they compiled.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros
cores=${PUNCTUM_JOBS:-$(nproc)}
# A compiler at work takes up to 1.5 GB.
jobs=$(awk -v n="$cores" '/MemAvailable/ { m = int($2 / 1500000) } END { if (m < 1) m = 1; print (m < n) ? m : n }' /proc/meminfo)

say() { printf '%-10s %s\n' "$1" "$2" >&2; }
fail() {
  printf '%s\n' "$*" >&2
  exit 1
}

running=
trap 'if [ -n "$running" ]; then kill "$running" 2>/dev/null; wait "$running"; fi; exit 130' INT TERM HUP

# failed_expectations LOG...: what tests and sanitizers complained about, each with the lines after it.
failed_expectations() {
  grep -hE -A 9 ': Failure$|^\[  FAILED  \] .*[a-z]\.|ERROR: [A-Z][A-Za-z]+Sanitizer|: runtime error: |Test timeout|Subprocess aborted' "$@" |
    cut -c1-400 | head -n 60
}

# What is worth seeing of a failed step's log: the compiler's first complaints, or those of tests, else its end.
show_failure() {
  local log=$1
  if grep -q -m1 '^FAILED: ' "$log"; then
    sed -n '/^FAILED: /,$p' "$log" | cut -c1-400 | head -n 60
  else
    cut -c1-400 "$log" | tail -n 60
    failed_expectations "$log" || true
  fi | sed 's/^/  /' >&2 # so that no line of it is taken for one of the step's caller
}

# step NAME WHAT LOG COMMAND...: runs COMMAND with its output in LOG; returns its exit code.
step() {
  local name=$1 what=$2 log=$3 start=$SECONDS told=0 code=0 progress seconds
  shift 3
  mkdir -p "$(dirname "$log")"
  "$@" >"$log" 2>&1 </dev/null 9>&- &
  running=$!
  sleep 0.1
  while kill -0 "$running" 2>/dev/null; do
    seconds=$((SECONDS - start))
    # The last line it wrote; of a compiler's or a test's, how far it is.
    progress=$(tail -c 2000 "$log" | tr '\r' '\n' | sed -En '/^\[[0-9]+\/[0-9]+\]|^ *[0-9]+\/[0-9]+ Test/s/^( *\[?[0-9]+\/[0-9]+\]?).*/\1/; /[^ ]/p' |
      tail -n 1 | tr -cd '[:print:]' | cut -c1-90) || true
    if [ -n "${PUNCTUM_PROGRESS:-}" ]; then printf '%-10s %s %s %d s\n' "$name" "$what" "$progress" "$seconds" >"$PUNCTUM_PROGRESS/$$"; fi
    if [ -t 2 ]; then
      printf '\r%-10s %s %s %d s \033[K' "$name" "$what" "$progress" "$seconds" >&2
    elif [ $((seconds - told)) -ge 30 ]; then
      told=$seconds
      say "$name" "$what ... $progress $seconds s"
    fi
    sleep 0.5
  done
  wait "$running" || code=$?
  running=
  seconds=$((SECONDS - start))
  if [ -t 2 ]; then printf '\r\033[K' >&2; fi
  if [ "$code" -eq 0 ]; then
    say "$name" "$what ($seconds s)"
  else
    say "$name" "$what FAILED after $seconds s; the whole output is in $log"
    show_failure "$log"
  fi
  return "$code"
}

# One build at a time in one tree; a second caller waits.
lock_build() {
  mkdir -p "$root/build" 2>/dev/null || true
  [ -w "$root/build" ] || fail "$root/build cannot be written to: remove it, or run this as its owner"
  exec 9>"$root/build/.lock"
  if ! flock -n 9; then
    say wait "another build runs in this tree"
    flock 9
  fi
}
unlock_build() { exec 9>&-; }

# known A|B: the first of them that this release of Debian has.
known() {
  local one
  for one in ${1//|/ }; do
    if [ -n "$(apt-cache madison "$one")" ]; then break; fi
  done
  printf '%s' "$one"
}

# install_packages SET...: what toolchain/packages lists and this machine lacks; no apt call when nothing is missing.
install_packages() {
  local sets=" $* " set package missing=() as_root=() there
  # What is installed, and what that provides: an npm, for example, that came with a nodejs of another origin.
  there=$(dpkg-query -W -f '${db:Status-Abbrev} ${Package} ${Provides}\n' | sed -n 's/^ii *//p' | sed 's/([^)]*)//g' | tr -s ', ' '\n\n')
  while read -r set package _; do
    case "$set" in '' | '#'*) continue ;; esac
    [[ $sets == *" $set "* ]] || continue
    grep -qxF "${package//|/$'\n'}" <<<"$there" || missing+=("$package")
  done <"$root/toolchain/packages"
  if [ ${#missing[@]} -eq 0 ]; then
    say packages "all there"
    return
  fi
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "missing packages, and neither root nor sudo to install them. As root: apt-get install --no-install-recommends ${missing[*]//|*/}"
    as_root=(sudo)
    # sudo may ask for a password here, once, where there is a terminal; later calls stay silent.
    sudo -n true 2>/dev/null || sudo -v || fail "sudo was refused. As root: apt-get install --no-install-recommends ${missing[*]//|*/}"
  fi
  local apt=(env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3)
  step packages "read the package lists" "$root/build/apt-update.log" "${as_root[@]}" "${apt[@]}" update || exit 1
  for package in "${!missing[@]}"; do missing[package]=$(known "${missing[package]}"); done
  step packages "install ${missing[*]}" "$root/build/apt-install.log" \
    "${as_root[@]}" "${apt[@]}" install --no-install-recommends "${missing[@]}" || exit 1
}

# build PRESET TARGET...: configures and builds; quick when nothing has changed.
build() {
  local preset=$1 dir=$root/build/$1
  shift
  (cd "$root" && step configure "$preset" "$dir/configure.log" cmake --preset "$preset") || return 1
  (cd "$root" && step build "$preset" "$dir/build.log" cmake --build --preset "$preset" --target "$@" -j "$jobs")
}
