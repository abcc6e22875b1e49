//! The profiles that have a counterpart in opendbc, and the states that are tried on each.

use super::car::Difference::{BothLevers, HazardElsewhere, LampBank, Reserved, TapHeld};
use super::car::{State, Vehicle, car, completed, file, packed};

const HONDA: &[State] = &[
    ("off", "", None),
    ("left", "LEFT_BLINKER=1", None),
    ("off after left", "", None),
    ("right", "RIGHT_BLINKER=1", None),
    ("right straight to left", "LEFT_BLINKER=1", None),
    ("both", "LEFT_BLINKER=1 RIGHT_BLINKER=1", Some(BothLevers)),
    ("off after both", "", None),
    ("tap left", "LEFT_BLINKER=1", Some(TapHeld)),
];

const CHRYSLER: &[State] = &[
    ("off", "", None),
    ("left", "TURN_SIGNALS=1", None),
    ("off after left", "", None),
    ("right", "TURN_SIGNALS=2", None),
    ("reserved 3", "TURN_SIGNALS=3", Some(Reserved)),
];

const SUBARU: &[State] = &[
    ("off", "", None),
    ("left", "LEFT_BLINKER~1", None),
    ("off after left", "", None),
    ("right", "RIGHT_BLINKER~1", None),
    ("right straight to left", "LEFT_BLINKER~1", None),
    ("hazard", "LEFT_BLINKER~1 RIGHT_BLINKER~1", None),
    ("off after hazard", "", None),
    ("left without flashing", "LEFT_BLINKER=1", None),
];

const NISSAN: &[State] = &[
    ("off", "", None),
    ("left", "LEFT_BLINKER=1", None),
    ("off after left", "", None),
    ("right", "RIGHT_BLINKER=1", None),
    ("hazard", "LEFT_BLINKER=1 RIGHT_BLINKER=1", None),
];

pub(crate) const VEHICLES: &[Vehicle] = &[
    packed(
        "acura_ilx_2016",
        &[
            car("acura_ilx_2016_can_generated", "ACURA_ILX"),
            car("acura_rdx_2018_can_generated", "ACURA_RDX"),
            car("honda_crv_touring_2016_can_generated", "HONDA_CRV"),
            car("honda_odyssey_twn_2018_generated", "HONDA_ODYSSEY_TWN"),
        ],
        "SCM_FEEDBACK",
        HONDA,
    ),
    packed(
        "bmw_e9x",
        &[file("bmw_e9x_e8x")],
        "TurnSignals",
        &[
            ("off", "TurnSignalIdle=1", None),
            ("left", "LeftTurn=1 TurnSignalActive=1", None),
            ("right", "RightTurn=1 TurnSignalActive=1", None),
            ("hazard", "LeftTurn=1 RightTurn=1 TurnSignalActive=1", None),
        ],
    ),
    packed(
        "chrysler_pacifica_2017",
        &[
            car("chrysler_pacifica_2017_hybrid_generated", "CHRYSLER_PACIFICA_2018"),
            car("chrysler_ram_dt_generated", "RAM_1500_5TH_GEN"),
            car("chrysler_ram_hd_generated", "RAM_HD_5TH_GEN"),
        ],
        "STEERING_LEVERS",
        CHRYSLER,
    ),
    packed(
        "fca_giorgio",
        &[file("fca_giorgio")],
        "BCM_1",
        &[
            ("off", "", None),
            ("left", "LEFT_TURN_STALK=1", None),
            ("right", "RIGHT_TURN_STALK=1", None),
            ("both", "LEFT_TURN_STALK=1 RIGHT_TURN_STALK=1", None),
        ],
    ),
    packed(
        "ford_fusion_2018",
        &[file("ford_fusion_2018_pt")],
        "Steering_Buttons",
        &[
            ("off", "", None),
            ("left", "Left_Turn_Light=1", None),
            ("right", "Right_Turn_Light=1", None),
            ("both", "Left_Turn_Light=1 Right_Turn_Light=1", None),
        ],
    ),
    packed(
        "ford_lincoln",
        &[car("ford_lincoln_base_pt", "FORD_ESCAPE_MK4")],
        "Steering_Data_FD1",
        &[
            ("off", "", None),
            ("left", "TurnLghtSwtch_D_Stat=1", None),
            ("right", "TurnLghtSwtch_D_Stat=2", None),
            ("reserved 3", "TurnLghtSwtch_D_Stat=3", None),
        ],
    ),
    packed(
        "gm_global_a",
        &[car("gm_global_a_powertrain_generated", "CHEVROLET_VOLT"), file("cadillac_ct6_powertrain")],
        "BCMTurnSignals",
        &[
            ("off", "", None),
            ("left", "TurnSignals=1", None),
            ("right", "TurnSignals=2", None),
            ("reserved 3", "TurnSignals=3", Some(Reserved)),
        ],
    ),
    packed(
        "gm_low_speed",
        &[file("gm_global_a_lowspeed")],
        "BlinkerStatus",
        &[
            ("off", "", None),
            ("left", "LeftBlinker=1", None),
            ("right", "RightBlinker=1", None),
            ("hazard", "LeftBlinker=1 RightBlinker=1", None),
        ],
    ),
    packed(
        "gwm_haval_h6_2024",
        &[file("gwm_haval_h6_phev_2024")],
        "LIGHTS",
        &[
            ("off", "", None),
            ("left", "LEFT_TURN_SIGNAL~1", None),
            ("right", "RIGHT_TURN_SIGNAL~1", None),
            ("hazard", "LEFT_TURN_SIGNAL~1 RIGHT_TURN_SIGNAL~1", None),
        ],
    ),
    packed(
        "honda_civic_hatchback_2017",
        &[
            car("honda_civic_hatchback_ex_2017_can_generated", "HONDA_CIVIC_BOSCH"),
            car("acura_rdx_2020_can_generated", "ACURA_RDX_3G"),
            car("honda_insight_ex_2019_can_generated", "HONDA_INSIGHT"),
            car("honda_e_advance_2020_can_generated", "HONDA_E_ADVANCE"),
            car("honda_common_canfd_generated", "HONDA_ACCORD_11G"),
            car("honda_bosch_radarless_generated", "HONDA_CIVIC_2022"),
        ],
        "SCM_FEEDBACK",
        HONDA,
    ),
    packed(
        "honda_civic_touring_2016",
        &[
            car("honda_civic_touring_2016_can_generated", "HONDA_CIVIC"),
            car("honda_odyssey_exl_2018_generated", "HONDA_ODYSSEY"),
            file("honda_clarity_hybrid_2018_can_generated"),
        ],
        "SCM_FEEDBACK",
        HONDA,
    ),
    packed(
        "hongqi_hs5",
        &[file("hongqi_hs5")],
        "TURN_SIGNALS",
        &[
            ("off", "", None),
            ("left", "LEFT_TURN_SIGNALING=1 LEFT_TURN_BULB_1~1", None),
            ("right", "RIGHT_TURN_SIGNALING=1 RIGHT_TURN_BULB_1~1", None),
            ("hazard", "LEFT_TURN_SIGNALING=1 RIGHT_TURN_SIGNALING=1", None),
        ],
    ),
    packed(
        "hyundai_canfd",
        &[
            car("hyundai_canfd_generated", "HYUNDAI_IONIQ_5"),
            car("hyundai_canfd_generated", "HYUNDAI_TUCSON_4TH_GEN"),
        ],
        "BLINKERS",
        &[
            ("off", "", None),
            ("left", "LEFT_LAMP~1", None),
            ("off after left", "", None),
            ("right", "RIGHT_LAMP~1", None),
            ("hazard", "LEFT_LAMP~1 RIGHT_LAMP~1", None),
            ("left of the other bank", "LEFT_LAMP_ALT~1 USE_ALT_LAMP=1", Some(LampBank)),
        ],
    ),
    packed(
        "hyundai_canfd",
        &[car("hyundai_canfd_generated", "HYUNDAI_KONA_EV_2ND_GEN")],
        "BLINKERS",
        &[
            ("off", "USE_ALT_LAMP=1", None),
            ("left", "LEFT_LAMP_ALT~1 USE_ALT_LAMP=1", None),
            ("off after left", "USE_ALT_LAMP=1", None),
            ("right", "RIGHT_LAMP_ALT~1 USE_ALT_LAMP=1", None),
            ("hazard", "LEFT_LAMP_ALT~1 RIGHT_LAMP_ALT~1 USE_ALT_LAMP=1", None),
        ],
    ),
    completed(
        "hyundai_i30_2014",
        &[file("hyundai_i30_2014")],
        "CLU2",
        &[
            ("off", "", None),
            ("left", "CF_Clu_TurnSigLh~1", None),
            ("right", "CF_Clu_TurnSigRh~1", None),
            ("hazard", "CF_Clu_TurnSigLh~1 CF_Clu_TurnSigRh~1", None),
        ],
    ),
    packed(
        "hyundai_kia",
        &[
            car("hyundai_kia_generic", "HYUNDAI_SONATA"),
            file("hyundai_2015_ccan"),
            file("hyundai_palisade_2023_generated"),
        ],
        "CGW1",
        &[
            ("off", "", None),
            ("left", "CF_Gway_TurnSigLh~1 CF_Gway_TSigLHSw=1", None),
            ("off after left", "", None),
            ("right", "CF_Gway_TurnSigRh~1 CF_Gway_TSigRHSw=1", None),
        ],
    ),
    packed(
        "jeep_cherokee_kl",
        &[car("chrysler_cusw", "JEEP_CHEROKEE_5TH_GEN")],
        "STEERING_LEVERS",
        &[
            ("off", "", None),
            ("left", "TURN_SIGNALS=1", None),
            ("off after left", "", None),
            ("right", "TURN_SIGNALS=2", None),
            ("reserved 3", "TURN_SIGNALS=3", Some(Reserved)),
        ],
    ),
    packed(
        "luxgen_s5",
        &[file("luxgen_s5_2015")],
        "CONSOLE_STATUS",
        &[
            ("off", "", None),
            ("left", "LEFT_SIGNAL_SWITCH=1", None),
            ("right", "RIGHT_SIGNAL_SWITCH=1", None),
            ("both", "LEFT_SIGNAL_SWITCH=1 RIGHT_SIGNAL_SWITCH=1", None),
        ],
    ),
    completed(
        "mazda_2017",
        &[car("mazda_2017", "MAZDA_CX5")],
        "TURN_SWITCH",
        &[
            ("off", "BLINK_INFO.", None),
            ("left", "TURN_LEFT_SWITCH=1 BLINK_INFO.LEFT_BLINK~1", None),
            ("off after left", "", None),
            ("right", "TURN_RIGHT_SWITCH=1 BLINK_INFO.RIGHT_BLINK~1", None),
        ],
    ),
    packed(
        "mercedes_e350_2010",
        &[file("mercedes_benz_e350_2010")],
        "DRIVER_CONTROLS",
        &[
            ("off", "", None),
            ("left", "LEFT_BLINKER=1", None),
            ("right", "RIGHT_BLINKER=1", None),
            ("both", "LEFT_BLINKER=1 RIGHT_BLINKER=1", None),
        ],
    ),
    packed("nissan_leaf_2018", &[car("nissan_leaf_2018_generated", "NISSAN_LEAF")], "LIGHTS", NISSAN),
    packed(
        "nissan_x_trail_2017",
        &[
            car("nissan_x_trail_2017_generated", "NISSAN_XTRAIL"),
            car("nissan_x_trail_2017_generated", "NISSAN_ALTIMA"),
        ],
        "LIGHTS",
        NISSAN,
    ),
    packed(
        "psa_aee2010",
        &[car("psa_aee2010_r3", "PSA_PEUGEOT_208")],
        "HS2_DAT_MDD_CMD_452",
        &[
            ("off", "HS2_DAT7_BSI_612.", None),
            ("left", "TURN_SIGNAL_STATUS=2 HS2_DAT7_BSI_612.CDE_CLG_ET_HDC=1", None),
            ("off after left", "", None),
            ("right", "TURN_SIGNAL_STATUS=1 HS2_DAT7_BSI_612.CDE_CLG_ET_HDC=2", None),
            ("hazard", "TURN_SIGNAL_STATUS=3 HS2_DAT7_BSI_612.CDE_CLG_ET_HDC=3", Some(Reserved)),
        ],
    ),
    completed(
        "rivian_r1",
        &[car("rivian_primary_actuator", "RIVIAN_R1")],
        "IndicatorLights",
        &[
            ("off", "", None),
            ("left 1", "TurnLightLeft=1", None),
            ("left 2", "TurnLightLeft=2", None),
            ("off after left", "", None),
            ("right 1", "TurnLightRight=1", None),
            ("right 2", "TurnLightRight=2", None),
            ("hazard", "TurnLightLeft=1 TurnLightRight=2", None),
            ("reserved 3", "TurnLightLeft=3", Some(Reserved)),
        ],
    ),
    packed(
        "subaru_global",
        &[
            car("subaru_global_2017_generated", "SUBARU_FORESTER"),
            car("subaru_global_2020_hybrid_generated", "SUBARU_CROSSTREK_HYBRID"),
        ],
        "Dashlights",
        SUBARU,
    ),
    packed(
        "subaru_outback_2015",
        &[
            car("subaru_outback_2015_generated", "SUBARU_OUTBACK_PREGLOBAL"),
            car("subaru_outback_2019_generated", "SUBARU_OUTBACK_PREGLOBAL_2018"),
            car("subaru_forester_2017_generated", "SUBARU_FORESTER_PREGLOBAL"),
        ],
        "Dashlights",
        SUBARU,
    ),
    packed(
        "tesla_model3",
        &[file("tesla_model3_vehicle")],
        "ID3F5VCFRONT_lighting",
        &[
            ("off", "", None),
            ("left", "VCFRONT_indicatorLeftRequest=1", None),
            ("right", "VCFRONT_indicatorRightRequest=2", None),
            (
                "hazard",
                "VCFRONT_indicatorLeftRequest=1 VCFRONT_indicatorRightRequest=1 VCFRONT_hazardLightRequest=1",
                None,
            ),
        ],
    ),
    packed(
        "tesla_model3_party",
        &[car("tesla_model3_party", "TESLA_MODEL_3"), car("tesla_model3_party", "TESLA_MODEL_X")],
        "UI_warning",
        &[
            ("off", "", None),
            ("left, dark", "leftBlinkerBlinking=1", None),
            ("left, lit", "leftBlinkerBlinking=2", None),
            ("off after left", "", None),
            ("right, dark", "rightBlinkerBlinking=1", None),
            ("right, lit", "rightBlinkerBlinking=2", None),
            ("reserved 3", "leftBlinkerBlinking=3", Some(Reserved)),
        ],
    ),
    completed(
        "tesla_model_s",
        &[file("tesla_can")],
        "STW_ACTN_RQ",
        &[
            ("off", "", None),
            ("left", "TurnIndLvr_Stat=1", None),
            ("right", "TurnIndLvr_Stat=2", None),
            ("reserved 3", "TurnIndLvr_Stat=3", None),
        ],
    ),
    completed(
        "tesla_model_s_powertrain",
        &[file("tesla_powertrain")],
        "STW_ACTN_RQ",
        &[
            ("off", "", None),
            ("left", "TurnIndLvr_Stat=1", None),
            ("right", "TurnIndLvr_Stat=2", None),
            ("reserved 3", "TurnIndLvr_Stat=3", None),
        ],
    ),
    packed(
        "toyota_nodsu",
        &[
            car("toyota_nodsu_pt_generated", "TOYOTA_COROLLA_TSS2"),
            car("toyota_new_mc_pt_generated", "TOYOTA_RAV4"),
            car("toyota_tnga_k_pt_generated", "LEXUS_NX"),
            car("toyota_secoc_pt_generated", "TOYOTA_RAV4_PRIME"),
        ],
        "BLINKERS_STATE",
        &[
            ("off", "TURN_SIGNALS=3 BODY_CONTROL_STATE.", None),
            ("left", "TURN_SIGNALS=1", None),
            ("off after left", "TURN_SIGNALS=3", None),
            ("right", "TURN_SIGNALS=2", None),
            ("hazard", "TURN_SIGNALS=3 HAZARD_LIGHT=1", Some(HazardElsewhere)),
            ("left, hazard", "TURN_SIGNALS=1 HAZARD_LIGHT=1", Some(HazardElsewhere)),
            ("reserved 0", "TURN_SIGNALS=0", Some(Reserved)),
        ],
    ),
    packed(
        "volvo_v40_2017",
        &[file("volvo_v40_2017_pt")],
        "MiscCarInfo",
        &[
            ("off", "", None),
            ("left", "TurnSignal=1", None),
            ("right", "TurnSignal=3", None),
            ("reserved 2", "TurnSignal=2", None),
        ],
    ),
    packed(
        "volvo_v60_2015",
        &[file("volvo_v60_2015_pt")],
        "MiscCarInfo",
        &[
            ("off", "", None),
            ("left", "TurnSignal=1", None),
            ("right", "TurnSignal=3", None),
            ("reserved 2", "TurnSignal=2", None),
        ],
    ),
    completed(
        "vw_meb",
        &[file("vw_meb")],
        "SMLS_01",
        &[
            ("off", "Blinkmodi_02. Licht_vorne_01.", None),
            ("left", "BH_Blinker_li=1", None),
            ("right", "BH_Blinker_re=1", None),
            ("hazard", "Blinkmodi_02.BM_Warnblinken=1", None),
        ],
    ),
    packed(
        "vw_mlb",
        &[car("vw_mlb", "AUDI_Q5_MK1"), car("vw_mlb", "PORSCHE_MACAN_MK1")],
        "BCM",
        &[
            ("off", "Blinkmodi_01.", None),
            ("left", "BLINKER_LEFT=1", None),
            ("off after left", "", None),
            ("right", "BLINKER_RIGHT=1", None),
            ("hazard", "BLINKER_LEFT=1 BLINKER_RIGHT=1 Blinkmodi_01.BM_Warnblinken=1", None),
            ("hazard bit alone", "Blinkmodi_01.BM_Warnblinken=1", Some(HazardElsewhere)),
        ],
    ),
    packed(
        "vw_mqb",
        &[car("vw_mqb", "VOLKSWAGEN_GOLF_MK7"), file("vw_mqbevo")],
        "Blinkmodi_02",
        &[
            ("off", "", None),
            ("left", "Comfort_Signal_Left=1 Left_Turn_Exterior_Bulb_1~1", None),
            ("off after left", "", None),
            ("right", "Comfort_Signal_Right=1 Right_Turn_Exterior_Bulb_1~1", None),
            ("hazard", "Hazard_Switch=1", Some(HazardElsewhere)),
        ],
    ),
    packed(
        "vw_pq",
        &[car("vw_pq", "VOLKSWAGEN_PASSAT_NMS")],
        "Gate_Komf_1",
        &[
            ("off", "", None),
            ("left", "GK1_Blinker_li=1", None),
            ("off after left", "", None),
            ("right", "GK1_Blinker_re=1", None),
            ("hazard", "GK1_Warnblk_Status=1", Some(HazardElsewhere)),
            ("tap left", "GK1_Blinker_li=1", Some(TapHeld)),
        ],
    ),
];
