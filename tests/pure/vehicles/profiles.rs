//! Each shipped profile: frames written by hand from public facts, and the reports they must give.

use std::collections::{BTreeMap, BTreeSet};

use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::time::MonoTime;
use signal_gateway::core::vehicle_lights::binding::TurnBinding;

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::playback::{HAZARD, TURN};
use crate::pure::vehicles::protection::protect;
use crate::pure::vehicles::{profile, profile_names};
use crate::support::clock::at_ms;
use crate::support::prerequisite::{require, shared_data};
use crate::support::virtual_gateway::VirtualGateway;

/// Profile, frames (see [`frame`], several with `;`; `9*` in front: nine times, 50 ms apart), and the outcome of turn
/// and hazard report: a constant's name, `unknown`, `invalid RAW`, `fault`, or a constant and `+fault` or `+fallback`.
type Case = (&'static str, &'static str, &'static str, &'static str);

const OFF: &str = "DISABLE";
const LEFT: &str = "ENABLE_LEFT";
const RIGHT: &str = "ENABLE_RIGHT";
const ON: &str = "ENABLE";

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("acura_ilx_2016", "294 8", OFF, "unknown"),
    ("acura_ilx_2016", "294 8 5|1@0=1", LEFT, "unknown"),
    ("acura_ilx_2016", "294 8 6|1@0=1", RIGHT, "unknown"),
    ("acura_ilx_2016", "294 8 5|1@0=1 6|1@0=1", "invalid at once", "unknown"),
    ("bmw_e9x", "1F6 2 9|1@1=1", OFF, OFF),
    ("bmw_e9x", "1F6 2 0|1@1=1", OFF, OFF),
    ("bmw_e9x", "1F6 2 4|1@1=1 8|1@1=1", LEFT, OFF),
    ("bmw_e9x", "1F6 2 5|1@1=1 8|1@1=1 6|1@1=1", RIGHT, OFF),
    ("bmw_e9x", "1F6 2 4|1@1=1 5|1@1=1 8|1@1=1", OFF, ON),
    ("bmw_e9x", "1F6 2 4|1@1=1 9|1@1=1", "invalid 33 (0x21)", "invalid 33 (0x21)"),
    ("bmw_e9x", "1F6 2 4|1@1=1 8|1@1=1 9|1@1=1", "invalid 49 (0x31)", "invalid 49 (0x31)"),
    ("chrysler_pacifica_2017", "318 8", OFF, "unknown"),
    ("chrysler_pacifica_2017", "318 8 0|2@1=1", LEFT, "unknown"),
    ("chrysler_pacifica_2017", "318 8 0|2@1=2", RIGHT, "unknown"),
    ("chrysler_pacifica_2017", "318 8 0|2@1=3", "invalid 3", "unknown"),
    ("dacia_sandero_2", "5DE 8", OFF, OFF),
    ("dacia_sandero_2", "5DE 8 0|8@1=32 24|8@1=128 56|8@1=66", LEFT, OFF),
    ("dacia_sandero_2", "5DE 8 0|8@1=64 24|8@1=128 56|8@1=66", RIGHT, OFF),
    ("dacia_sandero_2", "5DE 8 0|8@1=96 24|8@1=128 56|8@1=66", OFF, ON),
    ("demo_vehicle", "2A5 8; 2C1 8", OFF, OFF),
    ("demo_vehicle", "2A5 8 17|3@1=1; 2C1 8", LEFT, OFF),
    ("demo_vehicle", "2A5 8 17|3@1=2; 2C1 8", RIGHT, OFF),
    ("demo_vehicle", "2A5 8 17|3@1=1; 2C1 8 8|2@1=1", OFF, ON),
    ("demo_vehicle", "2A5 8 17|3@1=7; 2C1 8 8|2@1=3", "unknown", "unknown"),
    ("demo_vehicle", "2A5 8 17|3@1=6; 2C1 8 8|2@1=2", "fault", "fault"),
    ("demo_vehicle", "2A5 8 17|3@1=5", "invalid 5", "unknown"),
    ("demo_vehicle", "2A5 8 17|3@1=2 24|1@1=1; 2C1 8", "ENABLE_RIGHT +fault", OFF),
    ("demo_vehicle", "2A5 3 17|3@1=2; 2C1 1", "unknown", "unknown"),
    ("fca_giorgio", "73E 4", OFF, "unknown"),
    ("fca_giorgio", "73E 4 17|1@0=1", LEFT, "unknown"),
    ("fca_giorgio", "73E 4 16|1@0=1", RIGHT, "unknown"),
    ("fca_giorgio", "73E 4 17|1@0=1 16|1@0=1", "invalid at once", "unknown"),
    ("ford_falcon_fg", "128 8", OFF, "unknown"),
    ("ford_falcon_fg", "128 8 16|8@1=8", LEFT, "unknown"),
    ("ford_falcon_fg", "128 8 24|8@1=8", LEFT, "unknown"),
    ("ford_falcon_fg", "128 8 16|8@1=16", RIGHT, "unknown"),
    ("ford_falcon_fg", "128 8 24|8@1=16", RIGHT, "unknown"),
    ("ford_falcon_fg", "128 8 16|8@1=150", "invalid 150 (0x96)", "unknown"),
    ("ford_falcon_fg", "128 8 16|8@1=8 24|8@1=8", "invalid 2056 (0x808)", "unknown"),
    ("ford_fusion_2018", "083 8 28|1@0=1", OFF, "unknown"),
    ("ford_fusion_2018", "083 8 4|1@0=1", LEFT, "unknown"),
    ("ford_fusion_2018", "083 8 5|1@0=1", RIGHT, "unknown"),
    ("ford_fusion_2018", "083 8 4|1@0=1 5|1@0=1", "invalid at once", "unknown"),
    ("ford_lincoln", "083 8", OFF, "unknown"),
    ("ford_lincoln", "083 8 5|2@0=1", LEFT, "unknown"),
    ("ford_lincoln", "083 8 5|2@0=2", RIGHT, "unknown"),
    ("ford_lincoln", "083 8 5|2@0=3", OFF, "unknown"),
    ("gm_global_a", "140 3", OFF, "unknown"),
    ("gm_global_a", "140 3 19|2@0=1", LEFT, "unknown"),
    ("gm_global_a", "140 3 19|2@0=2", RIGHT, "unknown"),
    ("gm_global_a", "140 3 19|2@0=3", "invalid 3", "unknown"),
    ("gm_global_a", "140 2", "unknown", "unknown"),
    ("gm_low_speed", "1020C000 5", OFF, OFF),
    ("gm_low_speed", "1020C000 5 7|1@0=1", LEFT, OFF),
    ("gm_low_speed", "1020C000 5 6|1@0=1", RIGHT, OFF),
    ("gm_low_speed", "1020C000 5 7|1@0=1 6|1@0=1", OFF, ON),
    ("gwm_haval_h6_2024", "19C 16", "unknown", "unknown"),
    ("gwm_haval_h6_2024", "20*19C 16 30|1@0=0", OFF, OFF),
    ("gwm_haval_h6_2024", "20*19C 16; 3*19C 16 31|1@0=1; 14*19C 16", LEFT, OFF),
    ("gwm_haval_h6_2024", "20*19C 16; 3*19C 16 30|1@0=1; 14*19C 16", RIGHT, OFF),
    ("gwm_haval_h6_2024", "20*19C 16; 5*19C 16 30|1@0=1 31|1@0=1; 14*19C 16", OFF, ON),
    ("honda_civic_hatchback_2017", "326 8", OFF, "unknown"),
    ("honda_civic_hatchback_2017", "326 8 26|1@0=1", LEFT, "unknown"),
    ("honda_civic_hatchback_2017", "326 8 27|1@0=1", RIGHT, "unknown"),
    ("honda_civic_hatchback_2017", "326 8 26|1@0=1 27|1@0=1", "invalid at once", "unknown"),
    ("honda_civic_touring_2016", "326 8", OFF, "unknown"),
    ("honda_civic_touring_2016", "326 8 26|1@0=1", LEFT, "unknown"),
    ("honda_civic_touring_2016", "326 8 27|1@0=1", RIGHT, "unknown"),
    ("honda_civic_touring_2016", "326 8 26|1@0=1 27|1@0=1", "invalid at once", "unknown"),
    ("hongqi_hs5", "230 8", OFF, OFF),
    ("hongqi_hs5", "230 8 44|1@1=1", LEFT, OFF),
    ("hongqi_hs5", "230 8 45|1@1=1", RIGHT, OFF),
    ("hongqi_hs5", "230 8 44|1@1=1 45|1@1=1", OFF, ON),
    ("hyundai_canfd", "413 8", "unknown", "unknown"),
    ("hyundai_canfd", "40*413 8 62|1@0=0", OFF, OFF),
    ("hyundai_canfd", "40*413 8; 6*413 8 20|1@0=1; 8*413 8", LEFT, OFF),
    ("hyundai_canfd", "40*413 8; 6*413 8 22|1@0=1; 8*413 8", RIGHT, OFF),
    ("hyundai_canfd", "40*413 8; 6*413 8 20|1@0=1 22|1@0=1; 8*413 8", OFF, ON),
    ("hyundai_canfd", "40*413 8; 6*413 8 59|1@0=1 61|1@0=1; 8*413 8", OFF, OFF),
    ("hyundai_canfd", "40*413 8 62|1@0=1; 6*413 8 59|1@0=1 62|1@0=1; 8*413 8 62|1@0=1", LEFT, OFF),
    ("hyundai_canfd", "40*413 8 62|1@0=1; 6*413 8 61|1@0=1 62|1@0=1; 8*413 8 62|1@0=1", RIGHT, OFF),
    ("hyundai_i30_2014", "690 8", "unknown", "unknown"),
    ("hyundai_i30_2014", "20*690 8 49|1@1=1", OFF, OFF),
    ("hyundai_i30_2014", "20*690 8; 3*690 8 24|1@1=1; 14*690 8", LEFT, OFF),
    ("hyundai_i30_2014", "20*690 8; 3*690 8 25|1@1=1; 14*690 8", RIGHT, OFF),
    ("hyundai_i30_2014", "20*690 8; 5*690 8 24|1@1=1 25|1@1=1; 14*690 8", OFF, ON),
    ("hyundai_kia", "541 8", "DISABLE +fallback", "unknown"),
    ("hyundai_kia", "541 8 42|1@1=1", "ENABLE_LEFT +fallback", "unknown"),
    ("hyundai_kia", "541 8 41|1@1=1", "ENABLE_RIGHT +fallback", "unknown"),
    ("hyundai_kia", "541 8 41|1@1=1 42|1@1=1", "unknown", "unknown"),
    ("hyundai_kia", "30*541 8 33|2@1=1", OFF, OFF),
    ("hyundai_kia", "30*541 8; 5*541 8 19|2@1=1; 14*541 8", LEFT, OFF),
    ("hyundai_kia", "30*541 8; 5*541 8 42|1@1=1 19|2@1=3; 14*541 8 42|1@1=1", LEFT, OFF),
    ("hyundai_kia", "30*541 8; 5*541 8 62|2@1=2; 14*541 8", RIGHT, OFF),
    ("hyundai_kia", "30*541 8; 5*541 8 19|2@1=1 62|2@1=1; 14*541 8", OFF, ON),
    ("j1939_truck", "0CFDCC27 8", OFF, OFF),
    ("j1939_truck", "0CFDCC27 8 12|4@1=1 10|2@1=3", LEFT, "unknown"),
    ("j1939_truck", "0CFDCC27 8 12|4@1=2", RIGHT, OFF),
    ("j1939_truck", "0CFDCC27 8 12|4@1=1 10|2@1=1", OFF, ON),
    ("j1939_truck", "0CFDCC27 8 12|4@1=15 10|2@1=3", "unknown", "unknown"),
    ("j1939_truck", "0CFDCC27 8 12|4@1=14 10|2@1=2", "fault", "fault"),
    ("j1939_truck", "0CFDCC27 8 12|4@1=3", "invalid 3", OFF),
    ("j1939_truck", "0CFDCC28 8", "unknown", "unknown"),
    ("jeep_cherokee_kl", "4F0 7", OFF, "unknown"),
    ("jeep_cherokee_kl", "4F0 7 3|4@0=1", LEFT, "unknown"),
    ("jeep_cherokee_kl", "4F0 7 3|4@0=2", RIGHT, "unknown"),
    ("jeep_cherokee_kl", "4F0 7 3|4@0=3", "invalid 3", "unknown"),
    ("luxgen_s5", "410 8 3|1@0=1", OFF, "unknown"),
    ("luxgen_s5", "410 8 1|1@0=1", LEFT, "unknown"),
    ("luxgen_s5", "410 8 2|1@0=1", RIGHT, "unknown"),
    ("luxgen_s5", "410 8 1|1@0=1 2|1@0=1", "invalid at once", "unknown"),
    ("mazda_2017", "091 8", "DISABLE +fallback", "unknown"),
    ("mazda_2017", "091 8 13|1@0=1", "ENABLE_LEFT +fallback", "unknown"),
    ("mazda_2017", "091 8 12|1@0=1", "ENABLE_RIGHT +fallback", "unknown"),
    ("mazda_2017", "091 8 12|1@0=1 13|1@0=1", "unknown", "unknown"),
    ("mazda_2017", "30*09A 8", OFF, OFF),
    ("mazda_2017", "30*09A 8; 5*09A 8 18|1@1=1; 14*09A 8", LEFT, OFF),
    ("mazda_2017", "30*09A 8; 5*09A 8 19|1@1=1; 14*09A 8", RIGHT, OFF),
    ("mazda_2017", "30*09A 8; 5*09A 8 18|1@1=1 19|1@1=1; 14*09A 8", OFF, ON),
    ("mercedes_e350_2010", "045 8 18|1@0=1", OFF, "unknown"),
    ("mercedes_e350_2010", "045 8 16|1@0=1", LEFT, "unknown"),
    ("mercedes_e350_2010", "045 8 17|1@0=1", RIGHT, "unknown"),
    ("mercedes_e350_2010", "045 8 16|1@0=1 17|1@0=1", "invalid at once", "unknown"),
    ("mg", "46A 8", OFF, "unknown"),
    ("mg", "46A 8 3|2@0=1", LEFT, "unknown"),
    ("mg", "46A 8 3|2@0=2", RIGHT, "unknown"),
    ("mg", "46A 8 3|2@0=3", "invalid 3", "unknown"),
    ("new_eagle_dbw", "00001F14 8", OFF, OFF),
    ("new_eagle_dbw", "00001F14 8 4|3@1=1 7|1@1=1", LEFT, OFF),
    ("new_eagle_dbw", "00001F14 8 4|3@1=2", RIGHT, OFF),
    ("new_eagle_dbw", "00001F14 8 4|3@1=3", OFF, ON),
    ("new_eagle_dbw", "00001F14 8 4|3@1=7", "unknown", "unknown"),
    ("new_eagle_dbw", "00001F14 8 4|3@1=5", "invalid 5", "invalid 5"),
    ("nissan_leaf_2018", "358 8", OFF, OFF),
    ("nissan_leaf_2018", "358 8 17|1@0=1", LEFT, OFF),
    ("nissan_leaf_2018", "358 8 18|1@0=1", RIGHT, OFF),
    ("nissan_leaf_2018", "358 8 17|1@0=1 18|1@0=1", OFF, ON),
    ("nissan_leaf_aze0", "358 8 8|8@1=8 16|8@1=128", "unknown", "unknown"),
    ("nissan_leaf_aze0", "30*358 8 8|8@1=8 16|8@1=128", OFF, "unknown"),
    ("nissan_leaf_aze0", "30*358 8 8|8@1=8 16|8@1=128; 5*358 8 8|8@1=8 16|8@1=130", LEFT, "unknown"),
    ("nissan_leaf_aze0", "30*358 8 8|8@1=8 16|8@1=128; 60*358 8 8|8@1=8 16|8@1=130", LEFT, "unknown"),
    ("nissan_leaf_aze0", "30*358 8 8|8@1=8 16|8@1=128; 5*358 8 8|8@1=8 16|8@1=132", RIGHT, "unknown"),
    ("nissan_leaf_aze0", "30*358 8 8|8@1=8 16|8@1=128; 5*358 8 8|8@1=8 16|8@1=134", OFF, "unknown"),
    ("nissan_x_trail_2017", "453 8", OFF, OFF),
    ("nissan_x_trail_2017", "453 8 11|1@0=1", LEFT, OFF),
    ("nissan_x_trail_2017", "453 8 12|1@0=1", RIGHT, OFF),
    ("nissan_x_trail_2017", "453 8 11|1@0=1 12|1@0=1", OFF, ON),
    ("opel_260", "260 3 8|8@1=64 16|8@1=128", OFF, OFF),
    ("opel_260", "260 3 0|8@1=37 8|8@1=64 16|8@1=128", LEFT, OFF),
    ("opel_260", "260 3 0|8@1=58 8|8@1=64 16|8@1=128", RIGHT, OFF),
    ("opel_260", "260 3 0|8@1=31 8|8@1=64 16|8@1=128", OFF, ON),
    ("opel_260", "260 3 0|8@1=5 8|8@1=64 16|8@1=128", "invalid 5", "invalid 5"),
    ("opel_260", "260 8 0|8@1=37", "unknown", "unknown"),
    ("pacmod", "230 4 31|8@0=1", OFF, OFF),
    ("pacmod", "230 4 31|8@0=2", LEFT, OFF),
    ("pacmod", "230 4 31|8@0=0", RIGHT, OFF),
    ("pacmod", "230 4 31|8@0=3", OFF, ON),
    ("pacmod", "230 4 31|8@0=255", "unknown", "unknown"),
    ("pacmod", "230 4 31|8@0=254", "fault", "fault"),
    ("pacmod", "230 4 31|8@0=4", "invalid 4", "invalid 4"),
    ("pacmod", "230 4 31|8@0=2 6|1@1=1", "ENABLE_LEFT +fault", OFF),
    ("psa_aee2010", "452 6", OFF, OFF),
    ("psa_aee2010", "452 6 5|2@0=2", LEFT, OFF),
    ("psa_aee2010", "452 6 5|2@0=1", RIGHT, OFF),
    ("psa_aee2010", "452 6 5|2@0=3", OFF, ON),
    ("psa_can_confort", "0F6 8 59|1@1=1", OFF, OFF),
    ("psa_can_confort", "0F6 8 56|2@1=2", LEFT, OFF),
    ("psa_can_confort", "0F6 8 56|2@1=1", RIGHT, OFF),
    ("psa_can_confort", "0F6 8 56|2@1=3", OFF, ON),
    ("rivian_r1", "235 8", OFF, OFF),
    ("rivian_r1", "235 8 40|2@0=1", LEFT, OFF),
    ("rivian_r1", "235 8 40|2@0=2", LEFT, OFF),
    ("rivian_r1", "235 8 54|2@0=1", RIGHT, OFF),
    ("rivian_r1", "235 8 40|2@0=1 54|2@0=2", OFF, ON),
    ("rivian_r1", "235 8 40|2@0=3", "invalid 3", "invalid 3"),
    ("subaru_global", "390 8", "unknown", "unknown"),
    ("subaru_global", "20*390 8 48|1@1=1", OFF, OFF),
    ("subaru_global", "20*390 8; 3*390 8 50|1@1=1; 14*390 8", LEFT, OFF),
    ("subaru_global", "20*390 8; 3*390 8 51|1@1=1; 14*390 8", RIGHT, OFF),
    ("subaru_global", "20*390 8; 5*390 8 50|1@1=1 51|1@1=1; 14*390 8", OFF, ON),
    ("subaru_outback_2015", "282 8", "unknown", "unknown"),
    ("subaru_outback_2015", "20*282 8 12|4@1=9 40|1@1=1", OFF, OFF),
    ("subaru_outback_2015", "20*282 8; 282 8 44|1@1=1; 14*282 8", LEFT, OFF),
    ("subaru_outback_2015", "20*282 8; 282 8 45|1@1=1; 14*282 8", RIGHT, OFF),
    ("subaru_outback_2015", "20*282 8; 282 8 45|1@1=1; 20*282 8", OFF, OFF),
    ("subaru_outback_2015", "20*282 8; 3*282 8 44|1@1=1 45|1@1=1; 14*282 8", OFF, ON),
    ("tesla_model3", "3F5 8", OFF, OFF),
    ("tesla_model3", "3F5 8 0|2@1=1 50|2@1=1", LEFT, OFF),
    ("tesla_model3", "3F5 8 2|2@1=2 52|2@1=3", RIGHT, OFF),
    ("tesla_model3", "3F5 8 0|2@1=1 2|2@1=1 4|4@1=1", OFF, ON),
    ("tesla_model3", "3F5 8 0|2@1=2 4|4@1=6", OFF, ON),
    ("tesla_model3", "3F5 8 4|4@1=8", OFF, ON),
    ("tesla_model3", "3F5 8 0|2@1=3 4|4@1=9", "invalid 3", "invalid 9"),
    ("tesla_model3", "3F5 8 0|2@1=1 50|2@1=2", "ENABLE_LEFT +fault", OFF),
    ("tesla_model3_party", "311 7 22|1@0=1 23|1@0=1", OFF, "unknown"),
    ("tesla_model3_party", "311 7 25|2@0=1", LEFT, "unknown"),
    ("tesla_model3_party", "311 7 25|2@0=2", LEFT, "unknown"),
    ("tesla_model3_party", "311 7 26|2@1=1", RIGHT, "unknown"),
    ("tesla_model3_party", "311 7 26|2@1=2", RIGHT, "unknown"),
    ("tesla_model3_party", "311 7 25|2@0=1 26|2@1=2", OFF, "unknown"),
    ("tesla_model3_party", "311 7 25|2@0=3", "invalid 3", "unknown"),
    ("tesla_model_s", "045 8", OFF, "unknown"),
    ("tesla_model_s", "045 8 16|2@1=1", LEFT, "unknown"),
    ("tesla_model_s", "045 8 16|2@1=2", RIGHT, "unknown"),
    ("tesla_model_s", "045 8 16|2@1=3", "unknown", "unknown"),
    ("tesla_model_s_powertrain", "238 8", OFF, "unknown"),
    ("tesla_model_s_powertrain", "238 8 16|2@1=1", LEFT, "unknown"),
    ("tesla_model_s_powertrain", "238 8 16|2@1=2", RIGHT, "unknown"),
    ("tesla_model_s_powertrain", "238 8 16|2@1=3", "unknown", "unknown"),
    ("toyota_nodsu", "620 8; 614 8 29|2@0=3", OFF, OFF),
    ("toyota_nodsu", "620 8; 614 8 29|2@0=1", LEFT, OFF),
    ("toyota_nodsu", "620 8; 614 8 29|2@0=2 15|1@0=1", RIGHT, OFF),
    ("toyota_nodsu", "620 8; 614 8 29|2@0=1 27|1@0=1", OFF, ON),
    ("toyota_nodsu", "620 8; 614 8 27|1@0=1", "invalid 0", ON),
    ("toyota_nodsu", "620 8", "unknown", "unknown"),
    ("volvo_s60_2002", "0261300A 8", OFF, "unknown"),
    ("volvo_s60_2002", "0261300A 8 34|2@1=2", LEFT, "unknown"),
    ("volvo_s60_2002", "0261300A 8 34|2@1=1", RIGHT, "unknown"),
    ("volvo_s60_2002", "0261300A 8 34|2@1=3", "invalid 3", "unknown"),
    ("volvo_v40_2017", "2A9 8", OFF, "unknown"),
    ("volvo_v40_2017", "2A9 8 1|2@0=1", LEFT, "unknown"),
    ("volvo_v40_2017", "2A9 8 1|2@0=3", RIGHT, "unknown"),
    ("volvo_v40_2017", "2A9 8 1|2@0=2", "invalid 2", "unknown"),
    ("volvo_v60_2015", "40F 8", OFF, "unknown"),
    ("volvo_v60_2015", "40F 8 33|2@0=1", LEFT, "unknown"),
    ("volvo_v60_2015", "40F 8 33|2@0=3", RIGHT, "unknown"),
    ("volvo_v60_2015", "40F 8 33|2@0=2", "invalid 2", "unknown"),
    ("vw_meb", "3D4 8; 366 8; 658 8", OFF, OFF),
    ("vw_meb", "3D4 8 12|1@1=1; 366 8", LEFT, OFF),
    ("vw_meb", "3D4 8 13|1@1=1; 366 8", RIGHT, OFF),
    ("vw_meb", "3D4 8 12|1@1=1 13|1@1=1; 366 8", "invalid at once", OFF),
    ("vw_meb", "3D4 8 12|1@1=1; 366 8 20|1@1=1 25|1@1=1", OFF, ON),
    ("vw_meb", "3D4 8 13|1@1=1 46|1@1=1; 366 8", "ENABLE_RIGHT +fault", OFF),
    ("vw_meb", "3D4 8; 658 8 20|1@1=1", "DISABLE +fault", "unknown"),
    ("vw_meb", "3D4 8; 658 8 30|1@1=1", "DISABLE +fault", "unknown"),
    ("vw_mlb", "526 8; 363 4", OFF, OFF),
    ("vw_mlb", "526 8 34|1@0=1; 363 4", LEFT, OFF),
    ("vw_mlb", "526 8 35|1@0=1; 363 4", RIGHT, OFF),
    ("vw_mlb", "526 8 34|1@0=1 35|1@0=1; 363 4 10|1@1=1", OFF, ON),
    ("vw_mlb", "526 8", OFF, "unknown"),
    ("vw_mqb", "366 8 25|4@1=0 37|1@1=0", OFF, OFF),
    ("vw_mqb", "366 8 23|1@1=1 37|1@1=1", LEFT, OFF),
    ("vw_mqb", "366 8 24|1@1=1 26|1@1=1", RIGHT, OFF),
    ("vw_mqb", "366 8 20|1@1=1 25|4@1=15", OFF, ON),
    ("vw_mqb", "366 8 20|1@1=1 23|1@1=1 24|1@1=1", OFF, ON),
    ("vw_mqb", "366 8 23|1@1=1 24|1@1=1", OFF, OFF),
    ("vw_pq", "390 8", OFF, OFF),
    ("vw_pq", "390 8 34|1@1=1", LEFT, OFF),
    ("vw_pq", "390 8 35|1@1=1", RIGHT, OFF),
    ("vw_pq", "390 8 55|1@1=1", OFF, ON),
    ("vw_pq", "390 8 34|1@1=1 55|1@1=1", OFF, ON),
    ("vw_pq", "390 8 34|1@1=1 35|1@1=1 55|1@1=1", OFF, ON),
];

/// The outcome of the two reports after the frames, as in [`Case`].
fn outcome(profile_name: &str, frames: &str) -> [String; 2] {
    let mut gateway =
        VirtualGateway::starting_at(MonoTime::from_millis(5), profile(profile_name).gateway.clone());
    let mut sent = BTreeMap::new();
    // A counter is checked from the second frame on.
    for _ in 0..2 {
        for text in frames.split(';') {
            let (times, text) = text.split_once('*').unwrap_or(("1", text));
            let plain = frame(text);
            for _ in 0..times.trim().parse::<u32>().unwrap() {
                let count = sent.entry(plain.id().number()).or_insert(0_u8);
                let frame = protect(&plain, *count);
                *count = count.wrapping_add(1);
                gateway.receive(frame.id(), frame.data());
                if times != "1" {
                    gateway.now = at_ms(gateway.ms() + 50);
                }
            }
        }
    }
    let last = |states: Vec<&'static str>| states.last().copied().filter(|state| *state != "stops");
    let (turn, hazard) = (last(gateway.turn_states()), last(gateway.hazard_states()));
    [(TURN, turn), (HAZARD, hazard)].map(|(task, published)| {
        let (level, message) = gateway.level_and_message(task);
        let is_fault = message.starts_with("hardware fault: ");
        match (published, level) {
            (Some(report), Level::Ok) => report.to_owned(),
            (Some(report), Level::Warn) if message.starts_with("fallback ") => format!("{report} +fallback"),
            (Some(report), Level::Error) if is_fault => format!("{report} +fault"),
            (None, Level::Error) if message.starts_with("unknown: ") => "unknown".to_owned(),
            (None, Level::Error) if is_fault => "fault".to_owned(),
            (None, Level::Error) if message.starts_with("invalid: ") => match message.split(" = ").nth(1) {
                Some(rest) if rest.ends_with(" is not a defined value") => {
                    format!("invalid {}", rest.trim_end_matches(" is not a defined value"))
                }
                _ if message.ends_with(" = 1 at once is not defined") => "invalid at once".to_owned(),
                _ => message.clone(),
            },
            _ => format!("{published:?} {level} {message}"),
        }
    })
}

#[test]
fn each_payload_gives_the_report_that_public_facts_demand() {
    let mut wrong = Vec::new();
    for (profile, frames, turn, hazard) in CASES {
        let outcome = outcome(profile, frames);
        if outcome != [*turn, *hazard] {
            wrong.push(format!("{profile} {frames}: {outcome:?}, not {:?}", [turn, hazard]));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn every_shipped_profile_is_tried_off_left_and_right() {
    let mut tried: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (profile, _, turn, _) in CASES {
        tried.entry(profile).or_default().insert(turn);
    }
    let has_lights = |name: &String| !matches!(profile(name).gateway.lights.turn, TurnBinding::LeftOut);
    let names: Vec<_> = profile_names().into_iter().filter(has_lights).collect();
    assert!(tried.keys().eq(names.iter()), "{:?}", tried.keys());
    for (profile, turns) in tried {
        assert!([OFF, LEFT, RIGHT].iter().all(|turn| turns.contains(turn)), "{profile}");
    }
}

#[test]
fn labelled_frames_of_real_vehicles_give_their_labels() {
    let folder = require!(shared_data());
    for (profile, file, id, labels) in [
        (
            "dacia_sandero_2",
            "candrive-5de-labelled-frames.csv",
            "5DE",
            [("Off", OFF, OFF), ("Left", LEFT, OFF), ("Right", RIGHT, OFF), ("Hazard warning", OFF, ON)],
        ),
        (
            "opel_260",
            "candrive-opel-labelled-frames.csv",
            "260",
            [
                ("turning light idle", OFF, OFF),
                ("turning light left", LEFT, OFF),
                ("turning light right", RIGHT, OFF),
                ("jam indicator", OFF, ON),
            ],
        ),
    ] {
        let rows = std::fs::read_to_string(folder.join("can-logs").join(file)).unwrap();
        for (label, turn, hazard) in labels {
            // Label, identifier, two flags, length in hexadecimal, bytes.
            let row = rows.lines().find(|row| row.starts_with(&format!("{label},{id} ")));
            let cells: Vec<_> = row.unwrap_or_else(|| panic!("{label}")).split(',').skip(4).collect();
            let byte = |cell: &str| u8::from_str_radix(cell, 16).unwrap();
            let bytes = cells[1..].iter().take(byte(cells[0]).into()).enumerate();
            let text = bytes.fold(format!("{id} {}", byte(cells[0])), |text, (index, cell)| {
                format!("{text} {}|8@1={}", index * 8, byte(cell))
            });
            assert_eq!(outcome(profile, &text), [turn, hazard], "{profile} {label}");
        }
    }
}
