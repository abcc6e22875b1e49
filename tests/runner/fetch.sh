# What a test run fetches: Debian packages, Python environments, programs for cargo. Sourced by tests/run.
# shellcheck shell=bash
# shellcheck disable=SC2154 # logs: set by tests/run

# How long apt is waited for while another process has its lock, and how often a failed download is repeated.
apt_patience=${APT_PATIENCE:-300} download_repeats=2

# may_lack WHAT: whether even a full run may do without it.
may_lack() { [[ $(prerequisite "$1" 2) == may ]]; }

# prerequisite NAME COLUMN: 2 is may or must, 3 is how to get it.
prerequisite() {
    awk -v name="$1" -v column="$2" '$1 == name { if (column == 2) print $2; else { sub(/^[^ ]+ +[^ ]+ +/, ""); print } }' tests/prerequisites
}

# missing_prerequisites: a line for each thing that skipped something, with the way to get it.
missing_prerequisites() {
    local count what
    recorded skip | awk -F ': ' '{ n[$2]++ } END { for (what in n) print n[what], what }' | sort -k 2 |
        while read -r count what; do
            printf 'missing %s (%s skipped): %s\n' "$what" "$count" "$(prerequisite "$what" 3)"
        done
}

# apt ARGUMENT...: apt-get, which waits for the lock of another process, and tries failed downloads again.
apt() {
    local end=$((SECONDS + apt_patience)) failures=0 output noted=false
    until output=$(DEBIAN_FRONTEND=noninteractive timeout 900 apt-get -y -qq -o Acquire::Retries=$download_repeats "$@" 2>&1 </dev/null); do
        printf '%s\n' "$output" >>"$logs/apt.log"
        if grep -qE '(Could not get|Unable to (acquire|lock)|Could not open) .*(lock|directory)' <<<"$output"; then
            $noted || echo "note  apt is locked by another process; waiting for it"
            noted=true
            ((SECONDS < end)) || return 1
        elif ((++failures > download_repeats)); then
            return 1
        fi
        sleep 2
    done
    printf '%s\n' "$output" >>"$logs/apt.log"
}

# install PACKAGE...: Debian packages; nothing is installed where nothing is missing.
install() {
    (($#)) || return 0
    if [[ $(id -u) != 0 ]] || ! command -v apt-get >/dev/null; then
        echo "note  not root, or no apt; cannot install $*"
    elif ! {
        { [[ -e $logs/apt.log ]] || apt update; } && apt install --no-install-recommends "$@"
    }; then
        echo "note  apt failed, see $logs/apt.log; cannot install $*"
    fi
}

# lacking PROGRAM:PACKAGE...: the packages whose program is not there, for install.
lacking() {
    local pair
    for pair in "$@"; do command -v "${pair%%:*}" >/dev/null || echo "${pair##*:}"; done
}

# again COMMAND...: runs COMMAND until it succeeds, three times at most.
again() {
    local _
    for ((_ = 0; _ < download_repeats; _++)); do
        "$@" && return
        sleep 2
    done
    "$@"
}

# fetch_python VENV PIN...: a Python with these packages; the last word is said where there is none.
fetch_python() {
    local venv=$1 stamp=$1/pins log
    log=$logs/pip-${1##*/}.log
    shift
    if [[ $(cat "$stamp" 2>/dev/null) != "$*" ]]; then
        rm -rf "$venv"
        {
            python3 -m venv "$venv" &&
                again timeout 300 "$venv/bin/pip" install --quiet --disable-pip-version-check "$@" &&
                echo "$*" >"$stamp"
        } </dev/null >"$log" 2>&1
    fi
    [[ -e $stamp ]] || echo "note  cannot install $*: $(tail -n 1 "$log")"
}

# cargo_tool NAME VERSION: a program for cargo. Unoptimized: built in a third of the time, and used for seconds.
cargo_tool() {
    command -v "$1" >/dev/null || again timeout 900 cargo install --debug --locked --quiet --root target/tools \
        --target-dir target/tools/build "$1@$2" </dev/null >"$logs/$1.log" 2>&1 ||
        echo "note  cannot install $1 $2: $(grep -m 1 -E '^error|No space left' "$logs/$1.log"), see $logs/$1.log"
}
