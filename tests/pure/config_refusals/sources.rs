//! What is refused of lamps, stalks, buttons and several sources.

use crate::pure::config_refusals::{assert_refused, row};

const TURN: &str = "signal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n";
const HAZARD: &str = "from = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n";

#[test]
fn lamps_that_frames_cannot_tell_from_dark_ones_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(
                TURN,
                "kind = \"lamp\"\nleft_signal = @@{ signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = { signal = \"BLINK.RIGHT\", on = [1], off = [0] }\nboth_on = \"hazard\"\n",
                "turn.left_signal",
                "no period for BLINK: the DBC has no GenMsgCycleTime",
                "period_ms",
            ),
            row(
                TURN,
                "kind = \"lamp\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = { signal = \"BLINK.RIGHT\", on = [1], off = [0] }\nboth_on = \"hazard\"\n\
                 lamp = { period_ms = @@201 }\n",
                "turn.lamp.period_ms",
                "BLINK: a lamp in a message sent every 201ms cannot be told",
                "a message sent at each change",
            ),
            row(
                TURN,
                "kind = \"lamp\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = { signal = \"BLINK.RIGHT\", on = [1], off = [0] }\nboth_on = \"hazard\"\n\
                 lamp = { period_ms = 50, hold_ms = @@500 }\n",
                "turn.lamp.hold_ms",
                "a hold of 500ms is shorter than the dark time",
                "remove hold_ms",
            ),
            row(
                TURN,
                "kind = \"lamp\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = { signal = \"BLINK.RIGHT\", on = [1], off = [0] }\nboth_on = \"hazard\"\n\
                 lamp = { period_ms = 50, @@latency_ms = 20 }\n",
                "turn.lamp.latency_ms",
                "unknown key \"latency_ms\" with sent = \"cyclic\"",
                "period_ms",
            ),
            row(
                TURN,
                "kind = \"lamp\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = @@{ signal = \"OTHER.LAMP\", on = [1], off = [0] }\nboth_on = \"hazard\"\n\
                 lamp = { period_ms = 50 }\n[message.OTHER]\ntimeout_ms = 100\n",
                "turn.right_signal",
                "the lamps come in different messages",
                "two lamps of one message",
            ),
            row(
                TURN,
                "signal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n@@lamp = { hold_ms = 2000 }\n",
                "turn.lamp",
                "unknown key \"lamp\" without `kind`",
                "known here are",
            ),
        ],
    );
}

#[test]
fn stalks_and_buttons_that_make_no_sense_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(
                "[turn]\nsignal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n",
                "@@[turn]\nkind = \"stalk\"\nsignal = \"BLINK.TURN\"\nidle = [0]\nleft_half = [1]\n",
                "turn",
                "keys are missing: left_full, right_full",
                "a stalk needs",
            ),
            row(
                TURN,
                "kind = \"stalk\"\nsignal = \"BLINK.TURN\"\nidle = [0]\nleft_full = [2]\nright_full = [@@2]\n",
                "turn.right_full[1]",
                "2 overlaps 2",
                "one meaning",
            ),
            row(
                TURN,
                "kind = \"stalk\"\nsignal = \"BLINK.TURN\"\nidle = [0]\nleft_full = [2]\nright_full = [4]\n\
                 @@off = [1]\n",
                "turn.off",
                "unknown key \"off\" with kind = \"stalk\"",
                "left_full, right_full",
            ),
            row(
                TURN,
                "kind = \"stalk\"\nsignal = \"BLINK.TURN\"\nidle = [0]\nleft_full = [2]\nright_full = [4]\n\
                 stalk = { comfort_flashes = 3, comfort_ms = @@2000 }\n",
                "turn.stalk.comfort_ms",
                "exclude each other",
                "keep one",
            ),
            row(
                HAZARD,
                "from = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n@@startup_delay_ms = 100\n",
                "hazard.startup_delay_ms",
                "unknown key \"startup_delay_ms\" with from = \"signal\"",
                "known here are",
            ),
            row(
                HAZARD,
                "from = \"button\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\nmax_gap_ms = @@0\n",
                "hazard.max_gap_ms",
                "0 ms is out of range",
                "1 to 3600000 ms",
            ),
        ],
    );
}

#[test]
fn sources_that_contradict_their_list_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(
                "right = [2]\n",
                "right = [2]\ndisagreement_ms = @@100\n",
                "turn.disagreement_ms",
                "`disagreement_ms` needs several sources",
                "in `source`",
            ),
            row(
                "right = [2]\n",
                "right = [2]\n@@name = \"state\"\n",
                "turn.name",
                "unknown key \"name\" without `kind`",
                "known here are",
            ),
            row(
                TURN,
                "[[turn.source]]\nname = \"a\"\n@@while_hazard = \"keep\"\nsignal = \"BLINK.TURN\"\n\
                 off = [0]\nleft = [1]\nright = [2]\n",
                "turn.source[1].while_hazard",
                "unknown key \"while_hazard\" without `kind`",
                "known here are name, fallback",
            ),
            row(
                TURN,
                "[[turn.source]]\nname = \"a\"\nsignal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
                 [[turn.source]]\nname = @@\"a\"\nsignal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n",
                "turn.source[2].name",
                "\"a\" does not tell this source from the others",
                "a name of its own",
            ),
            row(
                HAZARD,
                "[[hazard.source]]\nname = \"a\"\nfrom = @@\"unbound\"\n",
                "hazard.source[1].from",
                "this is not a source",
                "[hazard] alone",
            ),
            row(
                HAZARD,
                "@@from = \"unbound\"\n[[hazard.source]]\nname = \"a\"\nfrom = \"signal\"\n\
                 signal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n",
                "hazard.from",
                "unknown key \"from\" beside `source`",
                "known here are",
            ),
        ],
    );
}
