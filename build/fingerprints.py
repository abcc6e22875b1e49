#!/usr/bin/env python3
"""Prints config/cars/fingerprints.toml: the identifiers and data lengths of the messages in opendbc's DBCs.

usage: fingerprints.py OPENDBC COMMIT > config/cars/fingerprints.toml

OPENDBC is a checkout of https://github.com/commaai/opendbc at COMMIT; its requirements must be installed, since its own generator
makes some of the DBCs. Only facts are taken: identifiers and lengths. DBCs of radars, and those with fewer than
8 messages are left out.
"""

import re
import sys
from pathlib import Path

MIN_MESSAGES = 8
MESSAGE = re.compile(r"^BO_\s+(\d+)\s+\S+?\s*:\s*(\d+)", re.MULTILINE)
EXTENDED, MAX_STANDARD, MAX_EXTENDED = 0x8000_0000, 0x7FF, 0x1FFF_FFFF

# DBCs of radars, whose identifiers are blocks of consecutive numbers that radars of other makes have as well, and of a robot.
LEFT_OUT = {
    "ESR",
    "FORD_CADS",
    "FORD_CADS_64",
    "acura_ilx_2016_nidec",
    "cadillac_ct6_object",
    "chrysler_pacifica_2017_hybrid_private_fusion",
    "comma_body",
    "ford_fusion_2018_adas",
    "gm_global_a_object",
    "hyundai_kia_mando_front_radar_generated",
    "mazda_radar",
    "rivian_mando_front_radar_generated",
    "tesla_radar_bosch_generated",
    "tesla_radar_continental_generated",
    "toyota_adas",
    "toyota_radar_dsu_tssp",
    "toyota_tss2_adas",
}

# Make and title of each other DBC.
TITLES = {
    "acura_ilx_2016_can_generated": ("Honda", "Acura ILX 2016"),
    "acura_rdx_2018_can_generated": ("Honda", "Acura RDX 2018"),
    "acura_rdx_2020_can_generated": ("Honda", "Acura RDX 2020"),
    "bmw_e9x_e8x": ("BMW", "BMW E8x and E9x"),
    "cadillac_ct6_powertrain": ("GM", "Cadillac CT6, powertrain"),
    "chrysler_cusw": ("Stellantis", "Jeep Cherokee KL (CUSW)"),
    "chrysler_pacifica_2017_hybrid_generated": ("Stellantis", "Chrysler Pacifica 2017, Jeep and Dodge"),
    "chrysler_ram_dt_generated": ("Stellantis", "Ram 1500 DT"),
    "chrysler_ram_hd_generated": ("Stellantis", "Ram HD"),
    "fca_giorgio": ("Stellantis", "Alfa Romeo Giulia and Stelvio (Giorgio)"),
    "ford_cgea1_2_bodycan_2011": ("Ford", "Ford CGEA 1.2, body"),
    "ford_cgea1_2_ptcan_2011": ("Ford", "Ford CGEA 1.2, powertrain"),
    "ford_fusion_2018_pt": ("Ford", "Ford Fusion 2018, powertrain"),
    "ford_lincoln_base_pt": ("Ford", "Ford and Lincoln, powertrain"),
    "gm_global_a_high_voltage_management": ("GM", "GM Global A, high voltage"),
    "gm_global_a_lowspeed": ("GM", "GM Global A, low speed, a few messages"),
    "gm_global_a_lowspeed_1818125": ("GM", "GM Global A, low speed"),
    "gm_global_a_powertrain_generated": ("GM", "GM Global A, powertrain"),
    "gwm_haval_h6_phev_2024": ("GWM", "Haval H6 2024"),
    "honda_bosch_radarless_generated": ("Honda", "Honda with camera alone"),
    "honda_civic_hatchback_ex_2017_can_generated": ("Honda", "Honda Civic hatchback 2017"),
    "honda_civic_touring_2016_can_generated": ("Honda", "Honda Civic 2016"),
    "honda_clarity_hybrid_2018_can_generated": ("Honda", "Honda Clarity 2018"),
    "honda_common_canfd_generated": ("Honda", "Honda with CAN FD"),
    "honda_crv_touring_2016_can_generated": ("Honda", "Honda CR-V 2016"),
    "honda_e_advance_2020_can_generated": ("Honda", "Honda e 2020"),
    "honda_insight_ex_2019_can_generated": ("Honda", "Honda Insight 2019"),
    "honda_odyssey_exl_2018_generated": ("Honda", "Honda Odyssey 2018"),
    "honda_odyssey_twn_2018_generated": ("Honda", "Honda Odyssey 2018, Taiwan"),
    "hongqi_hs5": ("Hongqi", "Hongqi HS5"),
    "hyundai_2015_ccan": ("Hyundai", "Hyundai and Kia 2015, chassis"),
    "hyundai_2015_mcan": ("Hyundai", "Hyundai and Kia 2015, multimedia"),
    "hyundai_can_generated": ("Hyundai", "Hyundai and Kia, classic CAN"),
    "hyundai_canfd_generated": ("Hyundai", "Hyundai and Kia, CAN FD"),
    "hyundai_i30_2014": ("Hyundai", "Hyundai i30 2014"),
    "hyundai_palisade_2023_generated": ("Hyundai", "Hyundai Palisade 2023"),
    "hyundai_santafe_2007": ("Hyundai", "Hyundai Santa Fe 2007"),
    "luxgen_s5_2015": ("Luxgen", "Luxgen S5 2015"),
    "mazda_2017": ("Mazda", "Mazda 2017"),
    "mazda_3_2019": ("Mazda", "Mazda 3 2019"),
    "mercedes_benz_e350_2010": ("Mercedes-Benz", "Mercedes-Benz E 350 2010"),
    "mg": ("MG", "MG"),
    "nissan_leaf_2018_generated": ("Nissan", "Nissan Leaf 2018"),
    "nissan_x_trail_2017_generated": ("Nissan", "Nissan X-Trail 2017"),
    "nissan_xterra_2011": ("Nissan", "Nissan Xterra 2011"),
    "opel_omega_2001": ("Opel", "Opel Omega 2001"),
    "psa_aee2010_r3": ("PSA", "Peugeot, Citroën, DS and Opel (AEE 2010)"),
    "rivian_primary_actuator": ("Rivian", "Rivian R1, primary actuators"),
    "subaru_forester_2017_generated": ("Subaru", "Subaru Forester 2017"),
    "subaru_global_2017_generated": ("Subaru", "Subaru Global 2017"),
    "subaru_global_2020_hybrid_generated": ("Subaru", "Subaru Global 2020, hybrid"),
    "subaru_outback_2015_generated": ("Subaru", "Subaru Outback 2015"),
    "subaru_outback_2019_generated": ("Subaru", "Subaru Outback 2019"),
    "tesla_can": ("Tesla", "Tesla Model S and X"),
    "tesla_model3_party": ("Tesla", "Tesla Model 3 and Y, party bus"),
    "tesla_model3_vehicle": ("Tesla", "Tesla Model 3 and Y, vehicle bus"),
    "toyota_2017_ref_pt": ("Toyota", "Toyota 2017, powertrain"),
    "toyota_iQ_2009_can": ("Toyota", "Toyota iQ 2009"),
    "toyota_new_mc_pt_generated": ("Toyota", "Toyota New MC, powertrain"),
    "toyota_nodsu_pt_generated": ("Toyota", "Toyota without DSU, powertrain"),
    "toyota_prius_2010_pt": ("Toyota", "Toyota Prius 2010, powertrain"),
    "toyota_secoc_pt_generated": ("Toyota", "Toyota with SecOC, powertrain"),
    "toyota_tnga_k_pt_generated": ("Toyota", "Toyota TNGA-K, powertrain"),
    "volvo_v40_2017_pt": ("Volvo", "Volvo V40 2017"),
    "volvo_v60_2015_pt": ("Volvo", "Volvo V60 2015"),
    "vw_meb_2024_generated": ("Volkswagen", "Volkswagen MEB 2024"),
    "vw_meb_generated": ("Volkswagen", "Volkswagen MEB"),
    "vw_mlb": ("Volkswagen", "Audi and Porsche MLB"),
    "vw_mqb": ("Volkswagen", "Volkswagen MQB"),
    "vw_mqbevo": ("Volkswagen", "Volkswagen MQB evo"),
    "vw_pq": ("Volkswagen", "Volkswagen PQ"),
}

HEADER = """\
# Identifiers and data lengths of the messages on the buses of known platforms, for `identify` and `check`.
# Made by build/fingerprints.py of public DBCs, of which it has nothing else.
#
# file: the DBC in the repository; below generator/ a template, of which the repository generates the DBC.
# standard, extended: identifiers of 11 and 29 bits by the length of their data in bytes, each as the distance from the one before,
# hexadecimal.
"""


def databases(folder):
    """Yields name, file and text of every DBC."""
    sys.path.insert(0, str(folder))
    from opendbc.dbc.generator.generator import generate_all, generator_path

    base = folder / "opendbc" / "dbc"
    for path in base.glob("*.dbc"):
        if not path.stem.endswith("_generated"):
            yield path.stem, path.relative_to(folder), path.read_text(encoding="utf-8", errors="replace")
    for name, text in generate_all().items():
        stem = name.removesuffix("_generated")
        templates = sorted(Path(generator_path).glob(f"*/{stem}.dbc"))
        # Without a template it is the DBC of a radar that has a script.
        yield name, templates[0].relative_to(folder) if templates else None, text


def identifier(number):
    """Returns bits and identifier; None for the number under which DBCs keep signals without a message."""
    bits = 29 if number > MAX_STANDARD else 11  # gm_global_a_lowspeed leaves the flag of 29 bits out
    return None if number & ~EXTENDED > MAX_EXTENDED else (bits, number & ~EXTENDED)


def rows(messages):
    """Yields the identifiers of each size as a row of TOML."""
    for key, bits in [("standard", 11), ("extended", 29)]:
        lengths = {}
        for (size, number), length in sorted(messages):
            if size == bits:
                lengths.setdefault(length, []).append(number)
        if lengths:
            steps = {length: [number - before for before, number in zip([0, *numbers], numbers)] for length, numbers in lengths.items()}
            texts = [f'{length} = "{" ".join(f"{step:X}" for step in steps[length])}"' for length in sorted(steps)]
            yield f"{key} = {{ {', '.join(texts)} }}"


def main():
    folder, commit = Path(sys.argv[1]).resolve(), sys.argv[2]
    print(HEADER, end="")
    print(f'repository = "commaai/opendbc"\ncommit = "{commit}"')
    for name, file, text in sorted(databases(folder), key=lambda database: database[0]):
        found = {(int(number), int(length)) for number, length in MESSAGE.findall(text)}
        messages = {(identifier(number), length) for number, length in found if identifier(number)}
        if len(messages) < MIN_MESSAGES or name in LEFT_OUT:
            continue
        make, title = TITLES[name]
        print(f'\n[[lists]]\nname = "{name}"\nmake = "{make}"\ntitle = "{title}"\nfile = "{file}"')
        for row in rows(messages):
            print(row)


if __name__ == "__main__":
    main()
