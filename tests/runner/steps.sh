# Steps of a test run: each is run into a log of its own, watched, timed and recorded. Sourced by tests/run.
# shellcheck shell=bash
# shellcheck disable=SC2154 # full, release, logs, patterns: set by tests/run
#
# Steps may run beside each other (`lane`), so a step's result is a line in the file $results, never a variable.

# Seconds without a sign of progress after which a step is stopped: no test has ended, or nothing was printed.
test_patience=${TEST_PATIENCE:-900} step_patience=${STEP_PATIENCE:-1200}
# A failure of these is a race of the product until it is shown otherwise, so a second run proves nothing.
never_unsteady='command|withdr|outage'
# But these are tests of commands of the command line.
may_be_unsteady='^process::[a-z]+_command::'
# More unsteady tests than this fail a run, and so many failures in one program are no accident.
max_unsteady=3 max_repeats=8

results=$logs/results

# record KIND TEXT: KIND is passed (TEXT is a number), failed, skip or unsteady.
record() { printf '%s\t%s\n' "$1" "$2" >>"$results"; }

# recorded KIND: the texts recorded as KIND.
recorded() { sed -n "s/^$1\t//p" "$results"; }

# wanted NAME: whether the names on the command line choose this step.
wanted() {
    local pattern
    ((${#patterns[@]})) || return 0
    for pattern in "${patterns[@]}"; do [[ $1 != *"$pattern"* ]] || return 0; done
    return 1
}

# log_of NAME: the file with the output of a step. Its standard error is in a second file with the ending .err.
log_of() { echo "$logs/${1//[^a-zA-Z0-9_]/-}.log"; }

# skip WHAT NAME WHY: NAME, a step, cannot run without WHAT. A failure where nothing may be lacking.
skip() {
    if $full && ! may_lack "$1"; then
        record failed "$2"
        printf 'FAIL  %s: %s is missing, and a full run must have it: %s\n' "$2" "$1" "$3"
    else
        printf 'skip  %s: %s: %s\n' "$2" "$1" "$3"
        record skip "$2: $1: $3"
    fi
}

# finish VERDICT NAME MORE: one line now, and the time of the step. Uses seconds and cpu.
finish() {
    printf '%-5s %s, %d s%s\n' "$1" "$2" "$seconds" "$3"
    note_time "$2"
}

# note_time NAME: the wall time and the processor time of a step, for the table at the end. Uses seconds and cpu.
note_time() { record time "$(printf '%d\t%.0f\t%s' "$seconds" "$cpu" "$1")"; }

# row NAME COLUMN: a field of the step's row in tests/runner/budgets.tsv.
row() { awk -F '\t' -v name="$1" -v column="$2" '$1 == name { print $column }' tests/runner/budgets.tsv; }

# budget NAME: the processor seconds of a step on this level; empty where there is none.
budget() { row "$1" "$($full && echo 3 || echo 2)" | grep -x '[0-9]*'; }

# list_inputs: the digests of all files of the project, for inputs_of; called before there are lanes.
list_inputs() {
    git ls-files -coz --exclude-standard 2>/dev/null | LC_ALL=C sort -zu | xargs -0r sha256sum 2>/dev/null >"$logs/files"
}

# inputs_of NAME PROGRAM: a digest of everything that the result of a step may depend on; empty where it is not known.
inputs_of() {
    local unaffected
    unaffected=$(row "$1" 4)
    [[ -n $unaffected ]] || return 0
    if [[ ! -s $logs/files ]]; then return 0; fi
    {
        if [[ $unaffected == program ]]; then
            unaffected='(\.rs|\.md|Cargo\.(toml|lock))$'
            sha256sum "$2"
        fi
        # Each line is a digest of 64 characters, two spaces and a path.
        unaffected=$unaffected awk 'substr($0, 67) !~ ENVIRON["unaffected"]' "$logs/files"
        env | grep -E '^(SIGNAL_GATEWAY|PROPTEST)_' | sort
        rustc -vV
        row "$1" 4
    } | sha256sum | cut -d ' ' -f 1
}

# The digests with which steps have passed.
passed_before=${PASSED_BEFORE:-target/passed}

# is_left_out NAME DIGEST: whether a step has passed with the same inputs and need not run; then that is said.
is_left_out() {
    local before=$passed_before/${1//[^a-zA-Z0-9_]/-}
    if $full || ((${#patterns[@]})) || [[ -z $2 || $(head -n 1 "$before" 2>/dev/null) != "$2" ]]; then return 1; fi
    printf 'left  %s: passed before, and nothing that it depends on has changed\n' "$1"
    record left_out "$1"
    sed 1d "$before" >>"$results"
}

# passed_with NAME DIGEST SKIP...: a whole step has passed, but for these that were skipped.
passed_with() {
    local name=$1 digest=$2
    shift 2
    if [[ -z $digest ]] || ((${#patterns[@]})); then return; fi
    mkdir -p "$passed_before"
    { echo "$digest" && if (($#)); then printf 'skip\t%s\n' "$@"; fi; } >"$passed_before/${name//[^a-zA-Z0-9_]/-}"
}

# watched PATIENCE LOG COMMAND...: runs COMMAND as a process group of its own, and ends it after PATIENCE seconds without
# progress. Returns its exit code; LOG.stopped is there if it was ended.
watched() {
    local patience=$1 log=$2 process watcher code
    shift 2
    rm -f "$log.stopped"
    setsid "$@" </dev/null >"$log" 2>"$log.err" &
    process=$!
    echo "$process" >>"$logs/groups"
    watch "$patience" "$log" "$process" &
    watcher=$!
    wait "$process"
    code=$?
    kill "$watcher" 2>/dev/null
    wait "$watcher" 2>/dev/null
    return "$code"
}

# watch PATIENCE LOG PROCESS: progress is a test that ended, or where there are none, anything printed.
watch() {
    local before='' now since=$SECONDS nap
    trap 'kill "$nap" 2>/dev/null; exit' TERM
    while true; do
        sleep 1 &
        nap=$!
        wait "$nap"
        now=$(grep -cE '(^| )(ok|FAILED|ignored)$' "$2")
        ((now)) || now=$(stat -c %s "$2" "$2.err" | paste -s)
        if [[ $now != "$before" ]]; then
            before=$now since=$SECONDS
        elif ((SECONDS - since >= $1)); then
            touch "$2.stopped"
            end_group "$3"
            return
        fi
    done
}

# end_group PROCESS: ends a process group that this run started, orderly if it will.
end_group() {
    kill -TERM -- "-$1" 2>/dev/null || return 0
    for _ in {1..50}; do
        sleep 0.2
        kill -0 -- "-$1" 2>/dev/null || return 0
    done
    kill -KILL -- "-$1" 2>/dev/null
}

# end_all: ends what is left of all steps, when this run is interrupted.
end_all() {
    local group
    while read -r group; do end_group "$group" & done <"$logs/groups"
    wait
}

# run PATIENCE NAME COMMAND...: runs COMMAND into the step's log. Sets code, seconds and cpu, its time of processors.
run() {
    local patience=$1 log begin=$SECONDS TIMEFORMAT='%U %S'
    log=$(log_of "$2")
    shift 2
    # In a shell of its own: the time of a shell has that of every child, and so of lanes that end meanwhile.
    ({ time watched "$patience" "$log" "$@"; } 2>"$log.cpu")
    code=$?
    seconds=$((SECONDS - begin))
    cpu=$(tail -n 1 "$log.cpu" | awk '{ print $1 + $2 }')
}

# end_of LOG PATIENCE: how a failed command ended.
end_of() {
    if [[ -e $1.stopped ]]; then
        echo ": stopped after $2 s without progress"
    else
        echo ", exit code $code"
    fi
}

# show_errors LOG: which checks of a script failed, and a compiler's errors where there are some, else the last lines.
show_errors() {
    grep -hE '^FAIL ' "$1" "$1.err" | head -n 20 | cut -c 1-300 | sed 's/^/    /'
    if grep -qE '^(error|warning: unused|Diff in )' "$1" "$1.err"; then
        sed -nE '/^(error|Diff in )/,$p' "$1" "$1.err" | head -n 60
    else
        cat "$1" "$1.err" | grep -vE '^ +(Compiling|Checking|Downloaded|Documenting) |^\{' | tail -n 40
    fi | cut -c 1-300 | sed 's/^/    | /'
}

# step [--again] NAME COMMAND...: a check that is not a test program. Exit code 77 is "not possible here", its last line of
# output the reason. With --again it meets processes and clocks, so that a failure may be unsteady.
step() {
    local name code seconds cpu log again=false
    [[ $1 != --again ]] || { again=true && shift; }
    name=$1
    wanted "$name" || return 0
    run "$step_patience" "$@"
    log=$(log_of "$name")
    if ((code == 0)); then
        record passed 1
        finish ok "$name" ''
    elif ((code == 77)); then
        skip "${name%% *}" "$name" "$(cat "$log" "$log.err" | tail -n 1 | sed 's/.*skipped: //')"
    elif $again; then
        cat "$log" "$log.err" >"$(log_of "unsteady $name").first"
        show_errors "$log"
        repeat_later "$@"
        finish again "$name" "$(end_of "$log" "$step_patience")"
    else
        record failed "$name"
        show_errors "$log"
        finish FAIL "$name" "$(end_of "$log" "$step_patience")"
    fi
}

# linted COMMAND...: with what cargo compiles of this package also linted by clippy, warnings as errors, as cargo clippy does
# it; but it compiles, so that dependencies and the package are not checked apart from that.
linted() {
    local -x RUSTC_WORKSPACE_WRAPPER=clippy-driver CLIPPY_ARGS=-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__
    "$@"
}

# build NAME ARGUMENT...: builds test programs; program_of finds them.
build() {
    local name=$1 code seconds cpu log
    shift
    log=$(log_of "$name")
    run "$step_patience" "$name" cargo test --no-run --message-format=json-render-diagnostics "$@"
    if ((code == 0)); then
        record passed 1
        finish ok "$name" ''
        return 0
    fi
    record failed "$name"
    show_errors "$log"
    finish FAIL "$name" "$(end_of "$log" "$step_patience")"
    return 1
}

# program_of BUILD PROGRAM: the path of a test program that the step BUILD built.
program_of() { sed -nE "s#.*\"executable\":\"([^\"]*/$2-[0-9a-f]*)\".*#\1#p" "$(log_of "$1")" | tail -n 1; }

# tests NAME COMMAND... -- ARGUMENT...: a program of libtest, perhaps behind a command that runs it. Counts its tests; one
# that says it is skipped has not passed. Slow ones are left to full runs and to names.
tests() {
    local name=$1 log command=() arguments=() chosen program ok bad skipped listed later=() part lacking verdict code seconds cpu digest
    shift
    while [[ $1 != -- ]]; do command+=("$1") && shift; done
    shift
    arguments=("$@")
    program=${command[-1]}
    is_marked "$name" "$program"
    if ! wanted "$name"; then
        arguments+=("${patterns[@]}" --include-ignored "${helpers[@]}")
        chosen=$("$program" --list --format terse "${arguments[@]}" 2>/dev/null | grep -c ': test$')
        ((chosen)) || return 0
    elif ((${#patterns[@]})) || $release; then
        arguments+=(--include-ignored "${helpers[@]}")
    else
        later=(::exhaustive::)
        $full || later+=(::slow::)
        listed=$("$program" --list --format terse "${arguments[@]}" "${later[@]}" 2>/dev/null | grep -c ': test$')
        record slow_left "$listed"
        for part in "${later[@]}"; do arguments+=(--skip "$part"); done
        ! $full || arguments+=(--include-ignored "${helpers[@]}")
    fi
    digest=$(inputs_of "$name" "$program")
    if is_left_out "$name" "$digest"; then return; fi
    log=$(log_of "$name")
    run "$test_patience" "$name" "${command[@]}" --show-output "${arguments[@]}"
    if ((code == 77)); then
        skip "${name%%[, ]*}" "$name" "$(tail -n 1 "$log.err" | sed 's/.*skipped: //')"
        return
    fi
    mapfile -t lacking < <(sed -n 's/^skipped: //p' "$log.err" | sort -u)
    skipped=${#lacking[@]}
    ((skipped == 0)) || printf 'skip\t%s\n' "${lacking[@]}" >>"$results"
    ok=$(($(ended ok "$log" | wc -l) - skipped)) bad=$(ended FAILED "$log" | wc -l)
    record passed "$ok"
    if ((code == 0)); then
        passed_with "$name" "$digest" ${lacking[@]+"${lacking[@]}"}
        ((skipped)) && skipped=", $skipped skipped" || skipped=
        finish ok "$name" ", $ok tests$skipped"
        return
    fi
    verdict=again
    if [[ -e $log.stopped ]] || ((bad == 0)); then # it crashed, or was stopped
        record failed "$name"
        verdict=FAIL
        echo '    its last lines:'
        cat "$log" "$log.err" | tail -n 15 | sed 's/^/    | /'
        unfinished_tests "$log" "$program" "${arguments[@]}" | sed 's/^/    was running: /'
    fi
    judge_failures "$log" "$bad" "${command[@]}"
    finish "$verdict" "$name" ", $bad of $((ok + bad)) tests failed$(end_of "$log" "$test_patience")"
}

# Not tests: tests run these as processes of their own.
helpers=(--skip hostile::taken_over --skip hostile::under_the_unit)

# is_marked NAME PROGRAM: slow and exhaustive tests have to be ignored, so that plain "cargo test" leaves them out.
is_marked() {
    local unmarked
    unmarked=$("$2" --list --format terse ::slow:: ::exhaustive:: 2>/dev/null | sed -n 's/: test$//p' |
        grep -vxFf <("$2" --list --format terse --ignored 2>/dev/null | sed -n 's/: test$//p'; echo))
    [[ -n $unmarked ]] || return 0
    record failed "$1: a slow test is not ignored"
    printf 'FAIL  %s: not ignored, though in a module for slow tests:\n' "$1"
    sed 's/^/    /' <<<"$unmarked"
}

# ended VERDICT LOG: the names of the tests that ended so.
ended() { sed -nE "s/^test (.*) \.\.\. $1\$/\1/p" "$2" | sed 's/ - should panic$//'; }

# unfinished_tests LOG PROGRAM ARGUMENT...: libtest begins tests in the order of its list, as many at once as it has
# threads: the first of those without a result were running.
unfinished_tests() {
    local log=$1 threads
    shift
    # With one thread, libtest writes the name before it runs the test.
    sed -nE 's/^test (.*) \.\.\. ?$/\1/p' "$log" | grep . && return
    threads=$(sed -nE 's/.*--test-threads=([0-9]+).*/\1/p' <<<"$*")
    "$@" --list --format terse 2>/dev/null | sed -n 's/: test$//p' |
        grep -vxFf <(sed -nE 's/^test (.*) \.\.\. (ok|FAILED|ignored)$/\1/p' "$log"; echo) |
        head -n "${threads:-$(nproc)}"
}

# judge_failures LOG COUNT COMMAND...: what failed is shown; what may be unsteady is noted, to be run once more when
# nothing else runs. Sets verdict to FAIL where a failure is final.
judge_failures() {
    local log=$1 count=$2 name
    shift 2
    while read -r name; do
        printf '    %s\n' "$name"
        output_of "$name" "$log" >"$(log_of "unsteady $name").first"
        head -n 30 "$(log_of "unsteady $name").first" | cut -c 1-300 | sed 's/^/    | /'
        if ((count > max_repeats)); then
            record failed "$name"
        elif [[ $name =~ $never_unsteady && ! $name =~ $may_be_unsteady ]]; then
            record failed "$name (not run again: a lost command or a late report is a race until shown otherwise)"
        else
            repeat_later "$name" "$@" --show-output --include-ignored --exact "$name"
            printf '    it is run again, alone, at the end\n'
            continue
        fi
        verdict=FAIL
        printf '    alone: tests/run %s\n' "$name"
    done < <(ended FAILED "$log")
}

# repeat_later NAME COMMAND...: COMMAND decides at the end whether what failed, a test or a step, is unsteady.
repeat_later() { printf '%s\0' "$@" >"$(log_of "unsteady $1").again"; }

# output_of TEST LOG: what a failed test printed, from its panic on.
output_of() {
    awk -v name="$1" '
        $0 == "failures:" { shown = 1 }
        /^---- .* stdout ----$/ { inside = shown && $2 == name; next }
        /^failures:$/ || /^test result:/ { inside = 0 }
        inside { lines[++count] = $0; if (!from && /panicked at/) from = count }
        END {
            if (!from) from = 1
            for (i = from; i <= count; i++) if (lines[i] != "") print lines[i]
        }' "$2"
}

# repeat_failures: runs what failed once more, when nothing else runs. One that passes now is unsteady, which
# is a failure too if it was so before: tests/unsteady keeps their names.
repeat_failures() {
    local again command name log code seconds cpu
    for again in "$logs"/unsteady-*.again; do
        [[ -e $again ]] || return 0
        mapfile -d '' -t command <"$again"
        name=${command[0]} log=${again%.again}
        run "$test_patience" "unsteady $name" "${command[@]:1}"
        cat "$log" "$log.err" >"$log.second"
        if ((code != 0)); then
            record failed "$name"
            printf 'FAIL  %s: also when it runs alone\n' "$name"
            show_errors "$log"
            printf '    alone: tests/run %s\n' "$name"
        elif grep -qE "^$name( |\$)" tests/unsteady; then
            record failed "$name (unsteady, as it was before: tests/unsteady)"
            printf 'FAIL  %s: unsteady, as tests/unsteady says it was before\n' "$name"
        else
            record passed 1
            record unsteady "$name, outputs: $log.first and $log.second"
            echo "$name $(date +%F)" >>tests/unsteady
            printf 'note  %s: passed when it ran alone\n' "$name"
        fi
    done
}

# lane NAME: runs the function NAME beside what follows; join waits for it.
declare -A lanes=()
lane() {
    "$1" &
    lanes[$1]=$!
}
join() {
    local name
    for name in "$@"; do
        wait "${lanes[$name]}"
        unset "lanes[$name]"
    done
}

# times: a table of the steps, and a line for each that used a fifth more than its budget or has none. A step that is chosen by name
# is not judged.
times() {
    local seconds cpu name limit all=0 over=()
    printf '%8s %9s %8s  %s\n' 'wall, s' 'used, s' 'budget' 'step; what it used is the time of processors'
    while IFS=$'\t' read -r seconds cpu name; do
        limit=$(budget "$name")
        printf '%8d %9d %8s  %s\n' "$seconds" "$cpu" "${limit:--}" "$name"
        all=$((all + cpu))
        over+=("$(exceeded "$name" "$cpu" "$limit")")
    done < <(recorded time)
    limit=$(budget all)
    printf '%8d %9d %8s  %s\n' "$SECONDS" "$all" "${limit:--}" all
    over+=("$(exceeded all "$all" "$limit")")
    if $release || ((${#patterns[@]})); then return; fi
    printf '%s\n' "${over[@]}" | grep .
}

# exceeded NAME USED BUDGET: a line where a step used a fifth more than its budget, or has none.
exceeded() {
    if [[ -z $3 ]]; then
        [[ -n $(row "$1" 1) ]] || echo "no budget: $1, which used $2 s (tests/runner/budgets.tsv)"
    elif (($2 * 5 > $3 * 6)); then
        echo "over budget: $1 used $2 s of processors, and may use $3 (tests/runner/budgets.tsv)"
    fi
}

# closing: what was skipped, unsteady or failed, left out, the table of times, and the counts in the last line. Exit code 1 where
# anything failed.
closing() {
    local passed failed skipped unsteady slow left_out
    passed=$(recorded passed | awk '{ n += $1 } END { print n + 0 }') slow=$(recorded slow_left | awk '{ n += $1 } END { print n + 0 }')
    unsteady=$(recorded unsteady | wc -l)
    if ((unsteady > max_unsteady)); then record failed "$unsteady unsteady tests, more than $max_unsteady"; fi
    skipped=$(recorded skip | wc -l) failed=$(recorded failed | wc -l)
    echo
    recorded skip | sed 's/^/skipped: /'
    missing_prerequisites
    if ((slow)); then echo "$slow slow tests are left to tests/run $($full && echo --release || echo --full)"; fi
    recorded unsteady | sed 's/^/unsteady: /'
    recorded failed | sed 's/^/failed: /'
    left_out=$(recorded left_out | paste -sd ';' | sed 's/;/; /g')
    if [[ -n $left_out ]]; then echo "left out, since nothing that they depend on has changed: $left_out"; fi
    times
    printf 'in %d min %d s\n' $((SECONDS / 60)) $((SECONDS % 60))
    if ((passed + failed + skipped == 0)); then
        echo "no step and no test has a name like: ${patterns[*]}"
        failed=1
    fi
    printf '%d passed, %d failed' "$passed" "$failed"
    ((skipped == 0)) || printf ', %d skipped' "$skipped"
    ((unsteady == 0)) || printf ', %d unsteady' "$unsteady"
    echo
    ((failed == 0))
}
