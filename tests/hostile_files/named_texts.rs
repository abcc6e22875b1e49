//! Maps, databases of messages, scenarios and configurations that are hostile on purpose.

use super::case::Case;
use super::named::NamedCase;
use super::recordings::{TEXT_FORMATS, drive, mcap, text};

/// How a hostile text is begun, repeated and ended.
struct Text {
    name: &'static str,
    runs: &'static [&'static str],
    begin: &'static str,
    piece: fn(usize) -> String,
    end: fn(usize) -> String,
}

const OSM: &str = "<?xml version=\"1.0\"?>\n<osm version=\"0.6\">\n";
const MAPPED: &[&str] = &["check {}", "decide --map {} --all-routes 3", "lights bench.toml --map {}"];
const LIGHTS: &[&str] = &["lights {} --without-map --until 10 --json"];
const BOUND: &[&str] = &["check drive.log -p car.toml"];
const XOSC: &str = "<?xml version=\"1.0\"?>\n<OpenSCENARIO>\n<FileHeader revMajor=\"1\" revMinor=\"2\" \
                    date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\n";
const ARXML: &str =
    "<?xml version=\"1.0\"?>\n<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\">\n<AR-PACKAGES>\n";

fn none(_: usize) -> String {
    String::new()
}

const TEXTS: &[Text] = &[
    Text {
        name: "deep.osm",
        runs: MAPPED,
        begin: OSM,
        piece: |_| "<way>".to_owned(),
        end: |times| "</way>".repeat(times),
    },
    Text {
        name: "empty_elements.osm",
        runs: MAPPED,
        begin: OSM,
        piece: |_| "<node/>".to_owned(),
        end: |_| "</osm>".to_owned(),
    },
    Text {
        name: "nodes.osm",
        runs: MAPPED,
        begin: OSM,
        piece: |at| format!("<node id=\"{at}\" lat=\"1\" lon=\"1\"/>\n"),
        end: |_| "</osm>".to_owned(),
    },
    Text {
        name: "tags.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><relation id=\"1\">",
        piece: |at| format!("<tag k=\"{at}\" v=\"\"/>"),
        end: |_| "</relation></osm>".to_owned(),
    },
    Text {
        name: "members.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><node id=\"1\" lat=\"0\" lon=\"0\"/><node id=\"2\" lat=\"1\" lon=\"1\"/><way id=\"1\"><nd ref=\"1\"/><nd ref=\"2\"/></way>\
                <relation id=\"9\"><tag k=\"type\" v=\"lanelet\"/>",
        piece: |_| {
            "<member type=\"way\" ref=\"1\" role=\"left\"/><member type=\"way\" ref=\"1\" role=\"right\"/>"
                .to_owned()
        },
        end: |_| "</relation></osm>".to_owned(),
    },
    Text {
        name: "references.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><node id=\"1\" lat=\"0\" lon=\"0\"/><node id=\"2\" lat=\"0.0001\" lon=\"0.0001\"/><way id=\"1\">",
        piece: |_| "<nd ref=\"1\"/><nd ref=\"2\"/>".to_owned(),
        end: |_| {
            let lanelet = |id: usize| {
                format!(
                    "<relation id=\"{id}\"><tag k=\"type\" v=\"lanelet\"/><tag k=\"subtype\" v=\"road\"/>\
                         <member type=\"way\" ref=\"1\" role=\"left\"/><member type=\"way\" ref=\"1\" role=\"right\"/></relation>"
                )
            };
            format!("</way>{}</osm>", (10..210).map(lanelet).collect::<String>())
        },
    },
    Text {
        name: "lanelets.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><node id=\"1\" lat=\"0\" lon=\"0\"><tag k=\"local_x\" v=\"0\"/><tag k=\"local_y\" v=\"0\"/></node>\
                <node id=\"2\" lat=\"0\" lon=\"0.1\"><tag k=\"local_x\" v=\"10\"/><tag k=\"local_y\" v=\"0\"/></node>\
                <node id=\"3\" lat=\"0.1\" lon=\"0\"><tag k=\"local_x\" v=\"0\"/><tag k=\"local_y\" v=\"3\"/></node>\
                <node id=\"4\" lat=\"0.1\" lon=\"0.1\"><tag k=\"local_x\" v=\"10\"/><tag k=\"local_y\" v=\"3\"/></node>\
                <way id=\"1\"><nd ref=\"1\"/><nd ref=\"2\"/></way><way id=\"2\"><nd ref=\"3\"/><nd ref=\"4\"/></way>",
        // All at the same place, each in conflict with each other.
        piece: |at| {
            format!(
                "<relation id=\"{}\"><member type=\"way\" ref=\"1\" role=\"right\"/><member type=\"way\" ref=\"2\" role=\"left\"/>\
                     <tag k=\"type\" v=\"lanelet\"/><tag k=\"subtype\" v=\"road\"/><tag k=\"turn_direction\" v=\"left\"/></relation>\n",
                at + 10
            )
        },
        end: |_| "</osm>".to_owned(),
    },
    Text {
        name: "long_attribute.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><node id=\"1\" lat=\"0\" lon=\"0\"><tag k=\"a\" v=\"",
        piece: |_| "&amp;&#65;".to_owned(),
        end: |_| "\"/></node></osm>".to_owned(),
    },
    Text {
        name: "attributes.osm",
        runs: MAPPED,
        begin: "<osm version=\"0.6\"><node ",
        piece: |at| format!("a{at}=\"\" "),
        end: |_| "/></osm>".to_owned(),
    },
    Text {
        name: "spaces.osm",
        runs: MAPPED,
        begin: OSM,
        piece: |_| "\n".to_owned(),
        end: |_| "</osm>".to_owned(),
    },
    Text {
        name: "endless_comment.osm",
        runs: MAPPED,
        begin: "<osm><!-- ",
        piece: |_| "- ".to_owned(),
        end: none,
    },
    Text {
        name: "deep.xosc",
        runs: LIGHTS,
        begin: XOSC,
        piece: |_| "<A>".to_owned(),
        end: |times| "</A>".repeat(times) + "</OpenSCENARIO>",
    },
    Text {
        name: "empty_elements.xosc",
        runs: LIGHTS,
        begin: XOSC,
        piece: |_| "<A/>".to_owned(),
        end: |_| "</OpenSCENARIO>".to_owned(),
    },
    Text {
        name: "attributes.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader ",
        piece: |at| format!("a{at}=\"\" "),
        end: |_| "/></OpenSCENARIO>".to_owned(),
    },
    Text {
        name: "namespaces.xosc",
        runs: LIGHTS,
        begin: XOSC,
        piece: |at| format!("<A xmlns:n{at}=\"x{at}\">"),
        end: |times| "</A>".repeat(times) + "</OpenSCENARIO>",
    },
    Text {
        name: "expression.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\
                <ParameterDeclarations><ParameterDeclaration name=\"a\" parameterType=\"double\" value=\"${",
        piece: |_| "(1+".to_owned(),
        end: |times| "1".to_owned() + &")".repeat(times) + "}\"/></ParameterDeclarations></OpenSCENARIO>",
    },
    Text {
        name: "sum.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\
                <ParameterDeclarations><ParameterDeclaration name=\"a\" parameterType=\"double\" value=\"${1",
        piece: |_| "+1".to_owned(),
        end: |_| "}\"/></ParameterDeclarations></OpenSCENARIO>".to_owned(),
    },
    Text {
        // Each is twice as long as the one before.
        name: "doubling.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\
                <ParameterDeclarations><ParameterDeclaration name=\"p0\" parameterType=\"string\" value=\"xxxxxxxxxxxxxxxx\"/>",
        piece: |at| {
            format!(
                "<ParameterDeclaration name=\"p{}\" parameterType=\"string\" value=\"$p{at}$p{at}\"/>\n",
                at + 1
            )
        },
        end: |_| "</ParameterDeclarations></OpenSCENARIO>".to_owned(),
    },
    Text {
        name: "controllers.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\
                <RoadNetwork><TrafficSignals>",
        piece: |at| {
            format!(
                "<TrafficSignalController name=\"c{at}\"><Phase name=\"p\" duration=\"0.001\">\
                     <TrafficSignalState trafficSignalId=\"{at}\" state=\"green\"/></Phase></TrafficSignalController>\n"
            )
        },
        end: |_| {
            "</TrafficSignals></RoadNetwork><Entities/><Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard></OpenSCENARIO>".to_owned()
        },
    },
    Text {
        name: "phases.xosc",
        runs: LIGHTS,
        begin: "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" author=\"\" description=\"\"/>\
                <RoadNetwork><TrafficSignals><TrafficSignalController name=\"c\">",
        piece: |at| {
            format!(
                "<Phase name=\"p{at}\" duration=\"0.000000001\"><TrafficSignalState trafficSignalId=\"1\" state=\"green\"/></Phase>\n"
            )
        },
        end: |_| {
            "</TrafficSignalController></TrafficSignals></RoadNetwork><Entities/><Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard></OpenSCENARIO>".to_owned()
        },
    },
    Text {
        name: "entities.xosc",
        runs: LIGHTS,
        begin: "<!DOCTYPE a [<!ENTITY b0 \"xxxxxxxxxx\">",
        piece: |at| format!("<!ENTITY b{} \"&b{at};&b{at};\">", at + 1),
        end: |times| format!("]><OpenSCENARIO>&b{times};</OpenSCENARIO>"),
    },
    Text {
        name: "deep.yaml",
        runs: LIGHTS,
        begin: "ScenarioModifiers: ",
        piece: |_| "[".to_owned(),
        end: none,
    },
    Text {
        name: "anchors.yaml",
        runs: LIGHTS,
        begin: "a0: &a0 x\n",
        piece: |at| format!("a{0}: &a{0} [*a{at}, *a{at}]\n", at + 1),
        end: none,
    },
    Text {
        name: "keys.yaml",
        runs: LIGHTS,
        begin: "OpenSCENARIO:\n",
        piece: |at| format!("  k{at}: {{}}\n"),
        end: none,
    },
    Text {
        name: "deep.toml",
        runs: &["lights {}", "decide {}", "check drive.log -c {}"],
        begin: "a = ",
        piece: |_| "[".to_owned(),
        end: |times| "]".repeat(times),
    },
    Text {
        name: "tables.toml",
        runs: &["lights {}", "decide {}", "check drive.log -c {}"],
        begin: "",
        piece: |at| format!("[a.k{at}]\n"),
        end: none,
    },
    Text {
        name: "dotted.toml",
        runs: &["lights {}", "decide {}", "check drive.log -c {}"],
        begin: "a",
        piece: |_| ".a".to_owned(),
        end: |_| " = 1\n".to_owned(),
    },
    Text {
        name: "controllers.toml",
        runs: &["lights {} --until 10 --json"],
        begin: "[groups]\n1 = [1]\n",
        piece: |at| {
            format!(
                "[[controller]]\nname = \"c{at}\"\n[[controller.phase]]\nname = \"p\"\nduration_s = 0.001\nstates = {{ \"1\" = \"green\" }}\n"
            )
        },
        end: none,
    },
    Text {
        name: "manoeuvres.toml",
        runs: &["decide {}"],
        begin: "name = \"x\"\ncompat = \"all\"\nmap = \"map.osm\"\nstart_m = 0\nuntil_m = 10\n[route]\nsegments = [[1]]\n\
                [drive]\nspeed = [{ at_m = 0, mps = 8 }]\n",
        piece: |_| {
            "[[manoeuvre]]\nkind = \"avoidance\"\nlines = [{ from_m = 0, to_m = 9, offset_m = -1.5 }]\n"
                .to_owned()
        },
        end: none,
    },
    Text { name: "deep.arxml", runs: BOUND, begin: ARXML, piece: |_| "<AR-PACKAGE>".to_owned(), end: none },
    Text {
        name: "empty_elements.arxml",
        runs: BOUND,
        begin: ARXML,
        piece: |_| "<A/>".to_owned(),
        end: |_| "</AR-PACKAGES></AUTOSAR>".to_owned(),
    },
    Text {
        name: "packages.arxml",
        runs: BOUND,
        begin: ARXML,
        piece: |_| "<AR-PACKAGE><SHORT-NAME>P</SHORT-NAME><AR-PACKAGES>".to_owned(),
        end: |times| "</AR-PACKAGES></AR-PACKAGE>".repeat(times) + "</AR-PACKAGES></AUTOSAR>",
    },
    Text {
        name: "frames.arxml",
        runs: BOUND,
        begin: "<?xml version=\"1.0\"?>\n<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\"><AR-PACKAGES><AR-PACKAGE><SHORT-NAME>F</SHORT-NAME><ELEMENTS>",
        piece: |at| {
            format!("<CAN-FRAME><SHORT-NAME>F{at}</SHORT-NAME><FRAME-LENGTH>8</FRAME-LENGTH></CAN-FRAME>")
        },
        end: |_| "</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>".to_owned(),
    },
    Text {
        name: "messages.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\n",
        piece: |at| format!("BO_ {at} M{at}: 8 X\n\n"),
        end: none,
    },
    Text {
        name: "signals.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nBO_ 1 M: 8 X\n",
        piece: |at| format!(" SG_ S{at} : 0|1@1+ (1,0) [0|1] \"\" X\n"),
        end: none,
    },
    Text {
        name: "values.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nBO_ 1 M: 8 X\n SG_ S : 0|8@1+ (1,0) [0|1] \"\" X\n\nVAL_ 1 S ",
        piece: |at| format!("{at} \"x\" "),
        end: |_| ";\n".to_owned(),
    },
    Text {
        name: "same_signal.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nBO_ 1 M: 8 X\n",
        piece: |_| " SG_ S : 0|1@1+ (1,0) [0|1] \"\" X\n".to_owned(),
        end: none,
    },
    Text {
        name: "bad_lines.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\n",
        piece: |_| "BO_ \n".to_owned(),
        end: none,
    },
    Text {
        name: "open_text.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nCM_ \"",
        piece: |_| "x\n".to_owned(),
        end: none,
    },
    Text {
        name: "attributes.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nBO_ 1 M: 8 X\n",
        piece: |_| "BA_ \"GenMsgCycleTime\" BO_ 1 100;\n".to_owned(),
        end: none,
    },
    Text {
        name: "multiplexers.dbc",
        runs: BOUND,
        begin: "VERSION \"\"\nBO_ 1 M: 8 X\n",
        piece: |at| format!(" SG_ S{at} m{at}M : 0|8@1+ (1,0) [0|1] \"\" X\n"),
        end: none,
    },
];

const BENCH: &str = "stop_at_s = 1\n[[controller]]\nname = \"c\"\n[[controller.phase]]\nname = \"p\"\nduration_s = 1\nstates = { \"1\" = \"green\" }\n";
const PROFILE: &str =
    "name = \"Car\"\n[turn]\nfitted = false\n[hazard]\nfrom = \"not_fitted\"\n[bus.body]\ndbc = ";

/// All of them, each of about `size` bytes.
pub(crate) fn all(size: usize) -> Vec<NamedCase> {
    let case = |text: &'static Text| {
        let make = move || {
            let mut content = text.begin.to_owned();
            let mut times = 0;
            while content.len() < size {
                content += &(text.piece)(times);
                times += 1;
            }
            content += &(text.end)(times);
            let profile = format!("{PROFILE}\"{}\"\ncluster = \"Body\"\n", text.name);
            Case::other(text.name, content.into_bytes(), text.runs)
                .with("bench.toml", BENCH)
                .with("drive.log", super::recordings::text(TEXT_FORMATS[0], &drive(20)))
                .with(
                    "car.toml",
                    if text.runs == BOUND && !text.begin.starts_with('<') {
                        profile.replace("cluster = \"Body\"\n", "")
                    } else {
                        profile
                    },
                )
        };
        (text.name, Box::new(make) as Box<dyn Fn() -> Case + Sync + Send>)
    };
    let mut all: Vec<_> = TEXTS.iter().map(case).collect();
    all.push((
        "map_of_zeros",
        Box::new(|| {
            let configuration = "profile = \"demo_vehicle\"\n[can.body]\ninterface = \"can0\"\n[traffic_lights]\nmap = \"/dev/zero\"\n";
            Case::other("zero.toml", configuration.into(), &["check drive.log -c {}", "replay drive.log -c {}", "lights bench.toml --map /dev/zero", "decide --map /dev/zero --all-routes 3"])
                .with("bench.toml", BENCH)
                .with("drive.log", text(TEXT_FORMATS[0], &drive(20)))
        }),
    ));
    for (name, device) in [("random_bytes", "/dev/urandom"), ("zeros", "/dev/zero")] {
        let make = move || {
            let commands = ["check", "decode", "replay", "identify"];
            let mut case = Case::recording(device, Vec::new(), &commands);
            case.files.clear();
            name.clone_into(&mut case.name);
            case.runs.extend([
                vec!["lights".to_owned(), device.to_owned()],
                vec!["decide".to_owned(), device.to_owned()],
            ]);
            case
        };
        all.push((name, Box::new(make)));
    }
    all.push((
        "drive_of_names.mcap",
        Box::new(move || {
            let names: Vec<u8> = (10..20_000_u16).flat_map(|id| mcap::schema(id, &[b'x'; 500])).collect();
            let chunk = mcap::chunk("zstd", 0, &super::packing::Packing::Zstd.pack(&names));
            let file = mcap::file(&chunk.repeat(size / chunk.len() + 1));
            let map = format!("{OSM}</osm>");
            Case::other("drive_of_names.mcap", file, &["decide {} --map map.osm"]).with("map.osm", map)
        }),
    ));
    all
}
