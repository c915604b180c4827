"""Files of rheometers and spreadsheets: what is read, and what is said of the rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pairsim.lab.rheometer.export_files import read_columns
from pairsim.runtime.errors import InputError

RATES = [0.1, 0.5, 2.5, 12.5, 62.5, 312.5]
VISCOSITIES = [2.5, 2.4, 2.1, 1.2, 0.7, 0.3]  # [Pa s]
STORAGE = [1.5, 20.5, 60.5, 90.5, 98.5, 99.5]
LOSS = [10.5, 49.5, 55.5, 45.5, 120.5, 500.5]
TURN = 2 * np.pi


def table(*columns: list[float], by: str = ",", comma: bool = False, before: str = "", after: str = "") -> str:
    """Lines of numbers, with what stands before and after each."""
    lines = [before + by.join(f"{value:.10g}" for value in row) + after for row in zip(*columns, strict=True)]
    return "\n".join(line.replace(".", ",") if comma else line for line in lines) + "\n"


def scaled(values: list[float], factor: float) -> list[float]:
    return [factor * value for value in values]


MILLI = scaled(VISCOSITIES, 1e3)
STRESS = [rate * eta for rate, eta in zip(RATES, VISCOSITIES, strict=True)]
COMPLEX = np.hypot(STORAGE, LOSS).tolist()
PHASE = np.degrees(np.arctan2(LOSS, STORAGE)).tolist()
TANGENT = np.divide(LOSS, STORAGE).tolist()
POINTS = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
TRIOS = """Filename\tPEO_1wt\nrundate\t27/07/2022\n[File Parameters]\nName\tPEO\nRun date\t27/07/2022 16:38:21
[step]\nPeak hold - 1\nTime\tStress\tShear rate\tViscosity\ns\tPa\t1/s\tPa.s\n{hold}
[step]\nFlow sweep - 2\nStress\tShear rate\tViscosity\tStep time\tTime\tNormal stress\nPa\t1/s\tPa.s\ts\ts\tPa\n{flow}
[step]\nFrequency sweep - 3\nStorage modulus\tLoss modulus\tTan(delta)\tAngular frequency\tOscillation strain rate
kPa\tPa\t\trad/s\t1/s\n{moduli}
[step]\nFlow sweep - 4\nStress\tShear rate\tViscosity\nPa\t1/s\tPa.s\n{again}"""
TRIOS = TRIOS.format(
    hold=table(POINTS, POINTS, [10.0, 10.1, 9.9, 10.0, 10.2, 9.8], POINTS, by="\t"),
    flow=table(STRESS, RATES, VISCOSITIES, POINTS, POINTS, scaled(POINTS, 3.0), by="\t"),
    again=table(STRESS, RATES, VISCOSITIES, by="\t"),
    moduli=table(scaled(STORAGE, 1e-3), LOSS, TANGENT, RATES, POINTS, by="\t"),
)
GERMAN = "Projekt:;PEO\nTest:;Fließkurve 1\nErgebnis:;Fließkurve 1\nIntervall und Messpunkte:;2;6\n\nIntervalldaten:;"
GERMAN += "Messpunkt;Scherrate;Schubspannung;Viskosität;Drehmoment;Status\n;;[1/s];[Pa];[mPa·s];[mN·m];[]\n"
FRENCH = (
    "Projet:\tPEO\n\nRésultat:\tFlow Curve 1\n\nIntervalle et points de données:\t3\t6\nInterval données:\tPoint No."
)
FRENCH += "\tContrainte de Cisaillement\tGradient de Cisaillement\tModule de Stockage\n\t\t\t\tSinusoïdes\n"
FRENCH += "\t\t[Pa]\t[1/s]\t[Pa]\n\t1  (invalide)\t\t\t\n"
LIMS = "[Step]\nStep name\tFrequency sweep (150.0 °C)\nNumber of points\t6\n"
LIMS += "Variables\tRun time\tAngular frequency\tStorage modulus\tLoss modulus\nUnits\ts\trad/s\tMPa\tkPa\n"
RSPACE = (
    "Action Name;Shear stress(Pa);Shear rate(s-¹);Normal force(N);Frequency(Hz);Shear modulus (elastic component)(Pa)"
)
RSPACE += ";Shear modulus (viscous component)(Pa)\n"

FLOW_CURVES = {
    "plain": "shear rate [1/s],viscosity [Pa.s]\n" + table(RATES, VISCOSITIES),
    "numpy, with spaces": "# shear rate [1/s]  viscosity [Pa s]\n" + table(RATES, VISCOSITIES, by=" "),
    "numpy, with words": "# gamma_dot_1_s eta_Pa_s\n" + table(RATES, VISCOSITIES, by=" "),
    "unit in the name": "shear_rate_1_s,viscosity_mPas\n" + table(RATES, MILLI),
    "words between": "Scherrate in 1/s;Viskosität in mPa·s\n" + table(RATES, MILLI, by=";", comma=True),
    "slashes": "Schergeschwindigkeit / s⁻¹;Viskosität / Pa s\n" + table(RATES, VISCOSITIES, by=";", comma=True),
    "symbols": "\u03b3\u0307 (s^-1)\tη (mPa·s)\n" + table(RATES, MILLI, by="\t"),
    "parentheses": "Shear Rate (1/sec),Viscosity (cP)\n" + table(RATES, MILLI),
    "nested": "Shear rate (1/s),Dynamic viscosity (kg/(m s))\n" + table(RATES, VISCOSITIES),
    "small letters": "shear rate [1/s],viscosity [mpa.s]\n" + table(RATES, MILLI),
    "poise": "Viscosity [P],Shear Rate [1/s],Shear stress [dyn/cm^2]\n"
    + table(scaled(VISCOSITIES, 10), RATES, scaled(STRESS, 10)),
    "a row of units": "Shear rate,Viscosity\n1/s,mPa.s\n" + table(RATES, MILLI),
    "minutes": "Shear rate,Viscosity\n1/min,Pa.s\n" + table(scaled(RATES, 60), VISCOSITIES),
    "a name below the units": "Shear rate,Viscosity\n1/s,Pa.s\n,Sample A\n" + table(RATES, VISCOSITIES),
    "LaTeX": "Shear rate [s$^{-1}$]\tμ {mPa.s}\n" + table(RATES, MILLI, by="\t"),
    "words of units": "Shear rate (reciprocal seconds);Viscosity_mPas_mean\n" + table(RATES, MILLI, by=";"),
    "a hyphen and a product": "Shear rate [s\u20111];Viscosity [mPa\u22c5s]\n" + table(RATES, MILLI, by=";"),
    "newtons": "Shear rate [s -1];Viscosity [mNs/m²]\n" + table(RATES, MILLI, by=";"),
    "units above the headings": "[1/s];[mPa.s]\nScherrate;Viskosität\n" + table(RATES, MILLI, by=";", comma=True),
    "units in columns": "Shear rate,Unit,Viscosity,Unit\n" + table(RATES, MILLI, by=",1/s,", after=",mPa.s"),
    "a letter apart": "rate (1/s),viscosity (m Pa s)\n" + table(RATES, MILLI),
    "Spanish": "Velocidad de cizalla [1/s];Esfuerzo cortante [Pa];Viscosidad [mPa·s]\n"
    + table(RATES, STRESS, MILLI, by=";", comma=True),
    "Italian": "Velocità di taglio [1/s];Sforzo di taglio [kPa]\n"
    + table(RATES, scaled(STRESS, 1e-3), by=";", comma=True),
    "Portuguese": "Taxa de cisalhamento (1/s)\tViscosidade (cP)\n" + table(RATES, MILLI, by="\t", comma=True),
    "headings on each page": "".join(
        "Shear rate (1/s),Viscosity (Pa.s)\n" + table(RATES[i : i + 2], VISCOSITIES[i : i + 2]) for i in (0, 2, 4)
    ),
    "headings of two lines": '"Shear rate\n[1/s]","Viscosity\n[Pa.s]"\n' + table(RATES, VISCOSITIES),
    "1/min": "Geschwindigkeitsgefälle in 1/min\tViskosität in Pas\n" + table(scaled(RATES, 60), VISCOSITIES, by="\t"),
    "Chinese": "剪切速率 [1/s],黏度 [mPa·s]\n" + table(RATES, MILLI),
    "Japanese": "せん断速度 [1/s],粘度 [mPa・s]\n" + table(RATES, MILLI),
    "a prefix apart": "shear rate (inverse seconds);viscosity in milli Pa s\n" + table(RATES, MILLI, by=";"),
    "pascal seconds": "shear rate 1/s;viscosity (milli-Pascal-seconds)\n" + table(RATES, MILLI, by=";"),
    "exponents of Fortran": "rate (1/s),viscosity (Pa s)\n" + table(RATES, VISCOSITIES, after="D0"),
    "one space": "# rate(1/s) eta(mPa s)\n" + table(RATES, MILLI, by=" "),
    "what was set": "Set shear rate [1/s],Shear rate [1/s],Viscosity [Pa.s]\n" + table(POINTS, RATES, VISCOSITIES),
    "what is true": "Apparent shear rate [1/s],True shear rate [1/s],Apparent viscosity [Pa.s],True viscosity [Pa.s]\n"
    + table(POINTS, RATES, POINTS, VISCOSITIES),
    "what is of something else": "Shear rate (max) [1/s],Shear rate [1/s],Solvent viscosity [Pa.s],Viscosity SD [Pa.s],"
    + "Viscosity [Pa.s]\n"
    + table(POINTS, RATES, POINTS, POINTS, VISCOSITIES),
    "thousands": "Scherrate [1/s];Viskosität [mPas]\n0,1;2.500,0\n0,5;2 400,00\n2,5;2'100,0\n12,5;1.200,00\n"
    + table(RATES[4:], MILLI[4:], by=";", comma=True),
    "stress": "shear rate [1/s],shear stress [kPa]\n" + table(RATES, scaled(STRESS, 1e-3)),
    "quoted decimal commas": '"shear rate [1/s]","viscosity [Pa.s]"\n'
    + table(RATES, VISCOSITIES, by='";"', before='"', after='"').replace(".", ",").replace('";"', '","'),
    "complex viscosity first": "Shear rate [1/s],|Eta*| [Pa.s],Viscosity [Pa.s]\n" + table(RATES, POINTS, VISCOSITIES),
    "torque in between": "Shear rate [1/s],Torque [mN.m],Viscosity [Pa.s]\n" + table(RATES, POINTS, VISCOSITIES),
    "aligned": "Shear rate [1/s]   Viscosity [Pa.s]\n" + table(RATES, VISCOSITIES, by="          ", before="   "),
    "empty columns of a spreadsheet": "Rate [1/s];Viscosity [Pa.s];;\n" + table(RATES, VISCOSITIES, by=";", after=";;"),
    "TRIOS": TRIOS,
    "RheoCompass, German": GERMAN + table(POINTS, RATES, STRESS, MILLI, POINTS, by=";", comma=True, before=";"),
    "RheoCompass, French": FRENCH + table(POINTS, STRESS, RATES, by="\t", comma=True, before="\t"),
    "rSpace": RSPACE
    + table(STRESS, [5.0] * 6, POINTS, by=";", comma=True, before="Pre Shear;", after=";;;")
    + table(STRESS, RATES, POINTS, by=";", comma=True, before="Flow Curve Up;", after=";;;"),
    "RheoWin": "C:\\RheoWin\\Data\\a.rwd\nCompany / Operator: IQ\n\n;GP in 1/s;Tau in Pa;Eta in Pas;T in °C;\n"
    + "1|1; ;0,06661; ; ;\n1|2; ;0,0977; ; ;\n"
    + table(RATES, STRESS, VISCOSITIES, by=";", comma=True, before="2|1;", after="; ;"),
}
SPECTRA = {
    "a complex modulus and a loss factor": "ω [rad/s],|G*| [Pa],tan(δ)\n" + table(RATES, COMPLEX, TANGENT),
    "a complex modulus and a phase": "Kreisfrequenz;Komplexer Schubmodul;Phasenwinkel\nrad/s;kPa;°\n"
    + table(RATES, scaled(COMPLEX, 1e-3), PHASE, by=";", comma=True),
    "a storage modulus and a loss factor": "omega [rad/s],G' [Pa],Loss factor [1]\n" + table(RATES, STORAGE, TANGENT),
    "a loss modulus and a phase": "omega [rad/s],G'' [Pa],phase angle [rad]\n"
    + table(RATES, LOSS, np.radians(PHASE).tolist()),
    "a complex viscosity and a phase": "Frequency [Hz],|η*| [mPa.s],Phase angle [°]\n"
    + table(scaled(RATES, 1 / TURN), np.divide(scaled(COMPLEX, 1e3), RATES).tolist(), PHASE),
    "Spanish": "Frecuencia angular [rad/s];Módulo de almacenamiento [Pa];Módulo de pérdida [Pa];Factor de pérdida [1]\n"
    + table(RATES, STORAGE, LOSS, TANGENT, by=";", comma=True),
    "Italian": "Frequenza [Hz];Modulo conservativo [Pa];Modulo dissipativo [Pa];Viscosità complessa [Pa·s]\n"
    + table(scaled(RATES, 1 / TURN), STORAGE, LOSS, np.divide(COMPLEX, RATES).tolist(), by=";", comma=True),
    "Portuguese": "Frequência angular [rad/s];Módulo complexo [Pa];Ângulo de fase [°]\n"
    + table(RATES, COMPLEX, PHASE, by=";", comma=True),
    "Hz": "Frequency [Hz],G' [Pa],G'' [Pa]\n" + table(scaled(RATES, 1 / TURN), STORAGE, LOSS),
    "row of mHz": "f,Storage modulus,Loss modulus\nmHz,kPa,Pa\n"
    + table(scaled(RATES, 1e3 / TURN), scaled(STORAGE, 1e-3), LOSS),
    "name of hertz": "frequency_hz,g_prime_pa,g_double_prime_pa\n" + table(scaled(RATES, 1 / TURN), STORAGE, LOSS),
    "turns": "Frequency [rpm],G' [Pa],G\" [Pa]\n" + table(scaled(RATES, 60 / TURN), STORAGE, LOSS),
    "loss factor first": "ω [rad/s];tan δ;Loss Factor;G\u2032 [Pa];G\u2033 [Pa]\n"
    + table(RATES, TANGENT, TANGENT, STORAGE, LOSS, by=";"),
    "both frequencies": "Frequency [Hz],Angular Frequency [rad/s],Storage Modulus [Pa],Loss Modulus [Pa],|G*| [Pa]\n"
    + table(scaled(RATES, 1 / TURN), RATES, STORAGE, LOSS, COMPLEX),
    "words": "omega_rad_per_s,G_storage_Pa,G_loss_Pa\n" + table(RATES, STORAGE, LOSS),
    "functions": "Frequency [rad/s],G'(ω) [Pa],G''(ω) [Pa]\n" + table(RATES, STORAGE, LOSS),
    "German": "Kreisfrequenz [1/s];Speichermodul [Pa];Verlustmodul [Pa];Verlustfaktor [1]\n"
    + table(RATES, STORAGE, LOSS, TANGENT, by=";", comma=True),
    "TRIOS": TRIOS,
    "TRIOS for LIMS": LIMS
    + table(POINTS, RATES, scaled(STORAGE, 1e-6), scaled(LOSS, 1e-3), by="\t", before="Data point\t"),
    "rSpace": RSPACE
    + table(STRESS, RATES, POINTS, by=";", before="Flow Curve Up;", after=";;;")
    + table(POINTS, scaled(RATES, 1 / TURN), STORAGE, LOSS, by=";", before="Oscillation Frequency Table;;;"),
    "RepTate": "T=140;Mw=116000;Mn=37000;\n" + table(RATES, STORAGE, LOSS, POINTS, by="      ", before=" "),
    "RepTate with headings": "Mw=2.4;T=-30;\nFreq\tG'\tG\"\tTemp\nrad/s\tPa\tPa\t°C\n"
    + table(RATES, STORAGE, LOSS, POINTS, by="    ", before="   "),
}


def written(folder: Path, text: str | bytes) -> Path:
    file = folder / "export.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize("kind", FLOW_CURVES)
def test_a_flow_curve_is_read(kind: str, tmp_path: Path) -> None:
    values, said = read_columns("rheology", written(tmp_path, FLOW_CURVES[kind]))
    assert values["rate"] == pytest.approx(RATES)
    assert values["viscosity"] == pytest.approx(VISCOSITIES)
    assert said[0].startswith("read: export.csv: 6 points, 0.1 to 312.5 1/s")
    assert not [each for each in said if "warning" in each]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
@pytest.mark.parametrize("kind", ["plain", "RheoCompass, German", "TRIOS"])
def test_every_encoding_is_read(kind: str, encoding: str, tmp_path: Path) -> None:
    content = FLOW_CURVES[kind].replace("\n", "\r\n").encode(encoding)
    values, _ = read_columns("rheology", written(tmp_path, content))
    assert values["viscosity"] == pytest.approx(VISCOSITIES)


@pytest.mark.parametrize(("encoding", "kind"), [("gb18030", "Chinese"), ("shift_jis", "Japanese")])
def test_encodings_of_east_asia_are_known_by_their_words(encoding: str, kind: str, tmp_path: Path) -> None:
    values, _ = read_columns("rheology", written(tmp_path, FLOW_CURVES[kind].encode(encoding)))
    assert values["viscosity"] == pytest.approx(VISCOSITIES)


@pytest.mark.parametrize("kind", SPECTRA)
def test_moduli_are_read(kind: str, tmp_path: Path) -> None:
    values, said = read_columns("spectrum", written(tmp_path, SPECTRA[kind]))
    assert values["frequency"] == pytest.approx(RATES)
    assert values["storage"] == pytest.approx(STORAGE)
    assert values["loss"] == pytest.approx(LOSS)
    assert not [each for each in said if "warning" in each]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("rate,viscosity\n" + table(RATES, MILLI), 'column 2 "viscosity", taken as Pa.s'),
        ("rate [1/s],viscosity [Pa.s]\n" + table(RATES, VISCOSITIES) + "400,overload\n500,\n",
         '2 of 8 rows left out; in the first one, line 8, column 2 "viscosity [Pa.s]"'),
        ("rate [1/s],viscosity [Pa.s],normal force [N]\n" + table(RATES, VISCOSITIES, POINTS),
         "N1 = 2 F/(pi R^2) needs"),
        ("rate [1/s],A viscosity [Pa.s],B viscosity [Pa.s]\n" + table(RATES, VISCOSITIES, POINTS),
         'column 3 "B viscosity [Pa.s]" is not read, although it may be viscosity, too'),
        ("rate [1/s],viscosity [Pa.s],N1 [Pa]\n" + table(RATES, VISCOSITIES, [1.0, -2.0, 3.0, 4.0, 5.0, 6.0]),
         "N1 is not positive at up to 0.5 1/s: 4 of its points, at larger rates, are read"),
        ("Taxa de cisalhamento (1/s);Viscosidade (Pa.s);Primeira diferença de tensões normais (Pa)\n"
         + table(RATES, VISCOSITIES, POINTS, by=";"), "N1 in Pa (column 3"),
        ("rate [1/s],rate [1/s],viscosity [Pa.s]\n" + table(RATES, POINTS, VISCOSITIES),
         'column 2 "rate [1/s]" is not read, although it may be rate, too'),
        (TRIOS, "not read: section 'Flow sweep - 4'; --section NAME reads another one"),
    ],
)  # fmt: skip
def test_what_is_left_out_or_assumed_is_said(text: str, says: str, tmp_path: Path) -> None:
    _, said = read_columns("rheology", written(tmp_path, text))
    assert says in " ".join(said)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (b"PK\x03\x04rest", "save the sheet with the table as CSV"),
        (bytes(range(256)) * 9, "export the table as CSV in UTF-8"),
        ("0.1,2\n0.2,3\n", "must have a line of headings of shear rate and"),
        ("rate [1/s],strain [%]\n1,2\n", "must have a line of headings of shear rate and viscosity or shear stress"),
        ("lg rate,log10 viscosity\n" + table(POINTS, POINTS), "viscosity [mPa.s], but has lg rate, log10 visc"),
        (SPECTRA["Hz"], "but has those of `spectrum`"),
        ("rate [1/s],viscosity [Pa.s]\n1,1\n2,0\n", "must have at least 5 rows of positive numbers"),
        ("rate [1/s],viscosity [Pa.s]\n" + "10,1\n" * 9, "a factor of 2 or more, but has 9, with rates from 10 to 10"),
        ("rate,,eta,\n1,1/s,2,Pa.s\n2,1/s,2,Pa.s\n3,1/s,2,P\n4,1/s,2,P\n5,1/s,2,P\n", "not Pa.s P"),
        ("rate (1/s),viscosity (in thousandths)\n" + table(RATES, MILLI), "not in thousandths"),
        ("rate (1/s),viscosity in thousandths\n" + table(RATES, MILLI), "not thousandths"),
        ("rate [Hz],viscosity [Pa.s]\n" + table(RATES, VISCOSITIES), 'a unit such as 1/s for "rate [Hz]", not Hz'),
        ("rate [1/s],viscosity [mPa]\n" + table(RATES, VISCOSITIES), "a unit such as Pa.s for"),
        ("rate [1/s],viscosity [MPA.S]\n" + table(RATES, VISCOSITIES), "not MPA.S"),
        ("rate [1/s],viscosity [MPas]\n" + table(RATES, VISCOSITIES), "not MPas"),
        ("rate [1/s],viscosity [MPa.s]\n" + table(RATES, VISCOSITIES), "not MPa.s"),
        ("Вязкость\n1\n".encode("cp1251"), "must be text in a recognisable encoding"),
        ("rate [1/s],viscosity [Pa.s]\n0,10,2,50\n0,20,2,40\n", "numbers and between them: line 2"),
        ("rate [1/s];viscosity [mPa.s]\n1;2.500\n5;1.800\n9;950\n", "2.500, whose mark may be that of decimals or"),
        ("rate [1/s],viscosity [Pa.s]\n" + table(POINTS, RATES, VISCOSITIES), "must have a heading over each column"),
        ("rate [1/s],viscosity [Pa.s]\n" + table(scaled(RATES, -1), VISCOSITIES), "must have rows of positive numbers"),
        ("rate [1/s],viscosity x1000 [Pa.s]\n" + table(RATES, MILLI), "a unit without a factor"),
        ("rate [1/s],viscosity/eta0\n" + table(RATES, VISCOSITIES), "must have a line of headings"),
        ("rate [1/s]\tviscosity [Pa.s]\n1,000\t2\n2,000\t3\n", "1,000, whose comma may mark decimals or thousands"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(text: str | bytes, says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="rheology: got") as refused:
        read_columns("rheology", written(tmp_path, text))
    assert says in str(refused.value)


def test_moduli_in_tension_are_not_those_in_shear(tmp_path: Path) -> None:
    text = "frequency [Hz],storage modulus E' [kPa],loss modulus E'' [kPa]\n" + table(RATES, POINTS, POINTS)
    with pytest.raises(InputError, match="must have a line of headings of frequency, storage modulus and loss modulus"):
        read_columns("spectrum", written(tmp_path, text))


def test_a_section_is_chosen_by_a_part_of_its_name(tmp_path: Path) -> None:
    file = written(tmp_path, TRIOS)
    assert "section 'Flow sweep - 4'" in read_columns("rheology", file, "sweep - 4")[1][0]
    with pytest.raises(InputError, match="must have a section named ramp, but has section 'Flow sweep - 2'"):
        read_columns("rheology", file, "ramp")
