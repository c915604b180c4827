"""Own one-dimensional solution of the Giesekus liquid of the paper (xi 0.09, alpha 0.2)."""

STEADY = {
    0.5: {
        "dp/L": 13.896025030,
        "u(0)": 1.699395184,
        "c_zz wall": 7.2824251,
        "c_rz wall": -1.3911059,
        "c_rr wall": 0.5772155,
    },
    1.0: {
        "dp/L": 9.452899283,
        "u(0)": 1.646464948,
        "c_zz wall": 11.4214195,
        "c_rz wall": -1.5673116,
        "c_rr wall": 0.4476997,
    },
}
"""Pressure gradient, largest velocity and conformation at the wall by De."""
START_UP = {0.05: 4.29971123, 0.1: 5.64378972, 0.25: 9.08872297, 0.5: 12.0374955, 1.0: 10.89484674, 2.0: 9.39146088}
"""Pressure gradient by the time after start-up at constant flow rate, De 1."""
