"""The cars that opendbc's documents list, as rows of config/cars/models.toml.

Prints a JSON object. `models`: make, model, years, name of the DBC with the lights, plug, wheel base in metres and steering ratio
of each car with a DBC; `others`: make, model, years and anchor of the reason for the cars without one. The list is that of the
opendbc that Python finds. Wheel base and ratio are what its controller is given, after the changes of each brand's code.
"""

import json
from typing import get_args

from opendbc.car import gen_empty_fingerprint
from opendbc.car.car_helpers import interfaces
from opendbc.car.docs_definitions import split_name
from opendbc.car.extra_cars import CAR as EXTRA
from opendbc.car.mock.values import CAR as MOCK
from opendbc.car.structs import CarParams
from opendbc.car.values import Platform


def parameters(platform):
    """The platform as its documents take it: some plugs depend on it."""
    known = platform if platform in interfaces else MOCK.MOCK
    unknown = [CarParams.CarFw(ecu=CarParams.Ecu.unknown)]
    fingerprint = gen_empty_fingerprint()
    return interfaces[known].get_params(known, fingerprint, unknown, alpha_long=True, is_release=True, docs=True)


def main():
    models, others = [], []
    for brand in (*get_args(Platform), EXTRA):
        for platform in brand:
            databases = getattr(platform.config, "dbc_dict", None) or {}
            databases = {str(bus): name for bus, name in databases.items()}
            dbc = databases.get("pt") or databases.get("party")
            for car in platform.config.car_docs:
                given = parameters(platform)
                car.init_make(given)
                make, model, years = split_name(car.name)
                if not years:
                    continue  # comma's robot
                row = [make, model, str(years)]
                if dbc:
                    parts = [part.value.name for part in car.car_parts.all_parts()] if car.car_parts else []
                    plugs = [name.removesuffix(" connector") for name in parts if name.endswith(" connector")]
                    geometry = [f"{value:.4g}" if value else "" for value in (given.wheelbase, given.steerRatio)]
                    models.append([*row, dbc, next(iter(plugs), ""), *geometry])
                else:
                    others.append([*row, str(getattr(car, "support_link", None) or "")])
    print(json.dumps({"models": sorted(models), "others": sorted(others)}))


main()
