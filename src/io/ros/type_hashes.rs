//! Hashes of message types, as ROS 2 has them since Iron (REP-2016): `RIHS01_` and SHA-256 of the type's fields.
//!
//! `rmw_zenoh` has them in its keys, so that nodes whose definitions of a type differ do not hear each other.
//! `tests/pure/type_hashes.rs` computes them from the definitions.

/// The hash of each type that is written or read, by package and name.
pub const TYPE_HASHES: [((&str, &str), &str); 21] = [
    (
        ("autoware_adapi_v1_msgs", "OperationModeState"),
        "RIHS01_c2e56618c8d545e53f586bee1019ef55e83491642e3d0ed21c5265f66f8c5d65",
    ),
    (
        ("autoware_internal_planning_msgs", "PathWithLaneId"),
        "RIHS01_e5b4e0eea87a930023fba98f283b7e6b3a48b36c20807d5e095799096ffa37db",
    ),
    (
        ("autoware_internal_planning_msgs", "PlanningFactorArray"),
        "RIHS01_4ea96c616b56e98c03ea542aa1dd3f17ee54270c7122fc0d19b9ace897f0150e",
    ),
    (
        ("autoware_internal_planning_msgs", "Scenario"),
        "RIHS01_b3d95421bc5262ee9821bc2804869d309452fa6f5ce6f37295958fa2759a2740",
    ),
    (
        ("autoware_perception_msgs", "TrafficLightGroupArray"),
        "RIHS01_6f6bf892681a43836041dabdac5e95dc3125f1f785d7455c77d09a8b4645fc90",
    ),
    (
        ("autoware_perception_msgs", "TrafficSignalArray"),
        "RIHS01_ec61a9fc4ea75acec0be576a85ee57a32705267ef32e1dbdd2992e5fb8510a4e",
    ),
    (
        ("autoware_planning_msgs", "LaneletRoute"),
        "RIHS01_ad6699d22cb153b658bad201b9e36a7870230388902c1b0d052d3198062f64ed",
    ),
    (
        ("autoware_planning_msgs", "PoseWithUuidStamped"),
        "RIHS01_3c143b0c6e5af1afb3422ecbf1c7e22c69f2cbbc0c29909a48025c77759c91d4",
    ),
    (
        ("autoware_vehicle_msgs", "ControlModeReport"),
        "RIHS01_968feaa6441be3c3b161f2eb65972a4b15394d0a7ddc4664318551280d1ff222",
    ),
    (
        ("autoware_vehicle_msgs", "HazardLightsCommand"),
        "RIHS01_ad2386a78a210625f1fb35f8043ef4e78da58cf01f33c340fa9468e5e8cdd0bc",
    ),
    (
        ("autoware_vehicle_msgs", "HazardLightsReport"),
        "RIHS01_01ce3b4293a5c2799fd7483b2d62a790e26fe8f2b5d60e48149163475685f28a",
    ),
    (
        ("autoware_vehicle_msgs", "TurnIndicatorsCommand"),
        "RIHS01_657d7f761a9b02c543e4bf3e0000405906b6169dc0bbfd6637c64fe00d98cec7",
    ),
    (
        ("autoware_vehicle_msgs", "TurnIndicatorsReport"),
        "RIHS01_c05a54cd244f1c9d683613b11c87a5b3ef816eed7a5f207368301221731a0964",
    ),
    (
        ("diagnostic_msgs", "DiagnosticArray"),
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ),
    (("nav_msgs", "Odometry"), "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
    (("rcl_interfaces", "Log"), "RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"),
    (
        ("rcl_interfaces", "ParameterEvent"),
        "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204",
    ),
    (("rosgraph_msgs", "Clock"), "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"),
    (("std_msgs", "String"), "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
    (
        ("traffic_simulator_msgs", "TrafficLightArrayV1"),
        "RIHS01_2580ba2313ad39a7762f7a62693ed571d072623be9a5f7c07497702c3eb3fd5c",
    ),
    (
        ("visualization_msgs", "MarkerArray"),
        "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    ),
];

/// The hash of each service for parameters, by its name in the package `rcl_interfaces`.
pub const SERVICE_HASHES: [(&str, &str); 6] = [
    ("DescribeParameters", "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff"),
    ("GetParameterTypes", "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca"),
    ("GetParameters", "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"),
    ("ListParameters", "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d"),
    ("SetParameters", "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0"),
    ("SetParametersAtomically", "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd"),
];

/// The hash of a service for parameters; `None` for another name.
pub fn service_hash(name: &str) -> Option<&'static str> {
    SERVICE_HASHES.iter().find(|(known, _)| *known == name).map(|(_, hash)| *hash)
}

/// The hash of a type; `None` for one that is neither written nor read.
pub fn type_hash(package: &str, name: &str) -> Option<&'static str> {
    TYPE_HASHES.iter().find(|(known, _)| *known == (package, name)).map(|(_, hash)| *hash)
}
