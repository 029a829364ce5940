"""What testing machines call their columns, sizes and tests, in the languages that they speak, and their units.

Words are compared without case and accents. A title is looked up from the first kind of column to the last; an entry
that ends in ``*`` matches words that begin so, one that begins with it words that end so. A unit outranks a word:
"Compression (mm)" is an extension and "Compression (%)" a strain.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, TypeAlias

Quantity: TypeAlias = Literal["other", "time", "strain", "stress", "force", "extension", "position", "height"]
Size: TypeAlias = Literal[
    "extensometer_length", "gauge_length", "grip_separation", "width", "wall", "thickness", "inner_diameter",
    "diameter", "area",
]  # fmt: skip
Dimension: TypeAlias = Literal["strain", "stress", "force", "length", "area", "time"]
OtherTest: TypeAlias = Literal[
    "shear", "bending", "torsion", "oscillation", "biaxial", "planar", "volumetric", "indentation"
]
Measure: TypeAlias = Literal["true", "Green", "Almansi", "second Piola-Kirchhoff", "Kirchhoff"]

COLUMN_WORDS: Mapping[Quantity, tuple[str, ...]] = MappingProxyType(
    {
        "other": (
            "rate", "*rate", "speed", "velocity", "*geschwindigkeit", "vitesse", "velocidad", "modulus", "*modul",
            "energy", "energie", "work", "arbeit", "lateral", "transverse", "transversal",
            "querdehnung", "querkontraktion", "width", "breiten*",
            "thickness", "cycle", "zyklus", "*number",
            "poisson", "temperature", "temperatur", "torque", "angle", "maximum", "max", "max.", "fmax", "minimum",
            "peak", "mean", "at", "break", "bruch", "yield", "offset",
            "setpoint", "set-point", "*setpoint", "target", "command", "commanded", "demand", "demanded", "programmed",
            "sollwert*", "soll", "*sollwert", "consigne",
            "std", "sd", "stdev", "std.", "deviation", "sem", "error", "err", "variance", "standardabweichung",
            "streuung", "ci", "confidence",
        ),
        "strain": (
            "strain", "*strain", "*dehnung", "stauchung", "epsilon", "ε", "e1", "exx", "eyy",
            "ezz", "εxx", "εyy", "εzz", "eng.strain", "engstrain",
            "deformation unitaire", "deformacion unitaria", "deformacao", "rek", "tojning", "tøjning", "tøyning",
            "odksztalcenie", "odkształcenie", "pomerna deformace", "относительная деформация", "변형률",
            "应变", "ひずみ",
        ),
        "stress": (
            "stress", "*stress", "*spannung", "sigma", "σ", "contrainte", "esfuerzo", "tension nominal", "sforzo",
            "tensione", "应力", "応力", "tensao", "*spanning", "spanning", "spænding", "spenning", "naprezenie",
            "naprężenie", "napeti", "напряжение", "응력", "gerilme",
        ),
        "force": (
            "force", "*force", "load", "*load", "*kraft", "fuerza", "carga", "forza", "carico", "charge", "f",
            "fx", "fy", "fz", "kraftaufnehmer", "kraftmessdose",
            "loadcell", "力", "試験力", "荷重", "forca", "kracht", "sila", "siła", "obciazenie", "сила", "нагрузка",
            "усилие", "하중", "시험력", "kuvvet",
        ),
        "extension": (
            "extension", "extensometer", "elongation", "displacement", "disp", "disp.", "stroke", "travel", "*weg",
            "distance", "abstand", "wegaufnehmer", "carrera", "corsa", "hub",
            "verlangerung", "langenanderung", "verformung", "deformation", "deformacion", "deformazione",
            "deplacement", "allongement", "course",
            "desplazamiento", "alargamiento", "elongacion", "spostamento", "allungamento", "deflection",
            "compression", "zusammendruckung", "ecrasement", "位移", "変位", "ストローク",
            "*displacement", "*extension", "*stroke", "deslocamento", "alongamento", "verplaatsing",
            "forskjutning", "forskydning", "forskyvning",
            "forlangning", "przemieszczenie", "wydluzenie", "wydłużenie", "posunuti", "prodlouzeni", "deformace",
            "перемещение", "удлинение", "변위", "신율", "uzama",
        ),
        "position": ("position", "*position", "crosshead", "crossheadposition", "actuator", "*traverse", "querhaupt",
            "traversa"),
        "height": (
            "height", "gap", "hohe", "hoehe", "probenhohe", "spalt", "hauteur", "entrefer", "altura", "altezza",
            "length", "lange", "laenge", "size", "hoogte", "hojd", "wysokosc", "vyska", "высота",
        ),
        "time": ("time", "*time", "*zeit", "zeit", "temps", "tiempo", "tempo", "t", "时间", "時間", "tijd", "tid",
            "czas", "cas", "время", "시간", "zaman"),
    }
)  # fmt: skip
"""Kinds of columns, in the order in which a title is looked up."""

_TRUE_WORDS = (
    "true", "wahre", "wahr", "vraie", "verdadera", "verdadero", "vera", "log", "logarithmic", "logarithmische*", "ln",
    "natural", "hencky", "cauchy",
)  # fmt: skip
MEASURE_WORDS: Mapping[Quantity, Mapping[Measure, tuple[str, ...]]] = MappingProxyType(
    {
        "strain": MappingProxyType(
            {
                "true": _TRUE_WORDS,
                "Green": ("green", "lagrange", "lagrangian"),
                "Almansi": ("almansi", "eulerian"),
            }
        ),
        "stress": MappingProxyType(
            {
                "true": _TRUE_WORDS,
                "second Piola-Kirchhoff": (
                    "pk2", "2pk", "2nd piola-kirchhoff", "second piola-kirchhoff", "2nd piola kirchhoff",
                    "second piola kirchhoff", "2nd piola", "second piola", "2nd pk", "second pk", "2. piola-kirchhoff*",
                ),
                "Kirchhoff": ("kirchhoff",),
            }
        ),
    }
)  # fmt: skip
"""Measures of strain and stress that refer to something else than the initial size of the specimen."""

NOMINAL_WORDS = (
    "engineering", "nominal", "technische", "conventionnelle", "ingenieril", "nenn*", "eng", "eng.strain",
    "pk1", "1pk", "1st piola-kirchhoff", "first piola-kirchhoff", "1st piola kirchhoff", "first piola kirchhoff",
    "1st piola", "first piola", "1st pk", "first pk",
)  # fmt: skip
CORRECTED_WORDS = (
    "corrected",
    "compensated",
    "korrigiert",
    "korrigierte",
    "corrige",
    "corregida",
    "corretto",
)
"""Of a column that is to be taken rather than the one that it corrects."""

CROSSHEAD_WORDS = (
    "crosshead",
    "extension",
    "stroke",
    "traverse",
    "traversenweg",
    "querhaupt",
    "displacement",
    "position",
)
EXTENSOMETER_WORDS = (
    "extensometer", "videoextensometer", "extensometre", "feindehnung*", "ansatzaufnehmer*", "dic", "video", "optical",
    "marks",
)  # fmt: skip
"""What measures on the specimen itself."""

LENGTHENING_WORDS = ("extension", "elongation", "verlangerung", "allongement", "alargamiento", "allungamento")
"""An extension that grows is said to lengthen, unless something tells otherwise."""

MODE_WORDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "compression": (
            "compression", "compressive", "compress", "compressed", "compressing", "compressao", "druktest",
            "drukproef", "kompression*", "tryckprov*", "trykprøve", "sciskanie", "ściskanie", "tlak*", "сжатие",
            "압축", "compresion", "compressione",
            "compresive", "druck", "druckversuch*", "druckprufung", "druckpruefung", "druckspannung", "druckkraft",
            "druckdehnung", "druckverformung", "druckweg", "stauch*", "zusammendruckung", "ecrasement", "圧縮", "压缩",
        ),
        "tension": (
            "tension", "tensile", "zug", "zugversuch*", "zugprufung", "zugpruefung", "zugspannung", "zugdehnung",
            "zugkraft", "traction", "traccion", "trazione", "pull", "pull-to-failure", "pulling", "stretching",
            "引張", "拉伸", "tracao", "trekproef", "trektest", "dragprov*", "trækprøve", "rozciaganie", "rozciąganie",
            "tah", "tahu", "растяжение", "인장",
        ),
    }
)  # fmt: skip
OTHER_TEST_WORDS: Mapping[OtherTest, tuple[str, ...]] = MappingProxyType(
    {
        "shear": ("shear", "scher*", "schub*", "cisaillement", "cizalladura", "taglio", "lap-shear"),
        "bending": (
            "bending", "bend", "flexure", "flexural", "biege*", "flexion", "flessione", "3-point", "three-point",
            "4-point", "four-point",
        ),
        "torsion": ("torsion", "torsional"),
        "oscillation": ("oscillation", "oscillatory", "oszillation", "amplitude"),
        "biaxial": ("biaxial", "equibiaxial", "equi-biaxial", "bulge", "inflation"),
        "planar": ("planar",),
        "volumetric": ("volumetric", "hydrostatic", "confined", "oedometer", "oedometric"),
        "indentation": ("indentation", "indent", "indenter", "nanoindentation"),
    }
)  # fmt: skip
"""Tests that neither pull nor push a specimen whose sides are free."""

MODE_STANDARDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "compression": (
            "astm d575",
            "astm d695",
            "astm d1621",
            "iso 604",
            "iso 7743",
            "iso 844",
            "din 53577",
        ),
        "tension": ("astm d412", "astm d638", "astm d882", "iso 37", "iso 527", "din 53504", "din 53455"),
    }
)
TEST_KIND_WORDS = (
    "test", "tests", "type", "method", "methode", "mode", "modus", "standard", "norm", "pruf*", "prufart", "pruef*",
    "versuch*", "*versuch", "essai", "ensayo", "prova", "ensaio", "*proef", "*prov", "*prøve", "zkouska",
    "испытание", "試験*", "试验", "*试验", "拉伸试验", "압축", "인장", "procedure", "direction", "richtung",
)  # fmt: skip
"""A line above the table tells the mode only where it speaks of the test, not of the machine."""

SIZE_WORDS: Mapping[Size, tuple[str, ...]] = MappingProxyType(
    {
        "extensometer_length": (
            "extensometer gauge length", "extensometer gage length", "gauge length extensometer",
            "gage length extensometer", "extensometer length", "extensometer", "messlange extensometer",
            "extensometer messlange", "ansatzaufnehmer*", "feindehnungsaufnehmer*", "extensometre",
        ),
        "grip_separation": (
            "grip separation", "grip to grip separation", "grip-to-grip separation", "distance between grips",
            "jaw separation", "einspannlange", "einspannlaenge", "entre mors", "distance entre mors",
        ),
        "gauge_length": (
            "gauge length", "gage length", "messlange", "messlaenge", "anfangsmesslange", "l0", "lo",
            "initial length", "anfangslange", "initial height", "probenhohe",
            "specimen height", "specimen length", "probenlange", "longueur initiale", "longitud inicial",
            "height", "hohe", "hoehe", "h0", "hauteur", "altura", "altezza", "length", "lange", "laenge", "longueur",
            "longitud", "lunghezza", "comprimento", "meetlengte", "lengte", "langd", "længde", "lengde", "dlugosc",
            "długość", "delka", "длина", "标距", "標点距離", "표점거리",
        ),
        "area": (
            "cross-section*", "cross section*", "crosssection*", "area", "querschnitt*", "probenquerschnitt", "s0",
            "section", "seccion", "sezione", "flache", "secao", "oppervlak*", "przekroj", "prurez", "площадь", "面积",
            "断面積", "단면적",
        ),
        "wall": ("wall thickness", "wall", "wandstarke", "wanddicke"),
        "inner_diameter": (
            "inner diameter", "inside diameter", "internal diameter", "innendurchmesser", "diametre interieur",
            "diametro interno", "diametro interior",
        ),
        "width": ("width", "breite", "probenbreite", "b0", "largeur", "ancho", "larghezza", "largura", "breedte",
            "bredd", "bredde", "szerokosc", "sirka", "ширина", "宽度", "幅", "폭"),
        "thickness": ("thickness", "dicke", "probendicke", "a0", "epaisseur", "espesor", "spessore", "espessura",
            "dikte", "tjocklek", "tykkelse", "grubosc", "tloustka", "толщина", "厚度", "厚さ", "두께"),
        "diameter": ("diameter", "durchmesser", "probendurchmesser", "aussendurchmesser", "d0", "diametre", "diametro",
            "srednica", "prumer", "диаметр", "直径", "지름", "⌀", "ø"),
    }
)  # fmt: skip
"""Names of a specimen's sizes; of several that a file states, the one that stands first here is taken."""

NOT_SIZE_WORDS = (
    "limit", "speed", "rate", "final", "failure", "break", "bruch", "end", "table", "data", "number",
    "cell", "wave*", "cable", "focal", "stroke",
)  # fmt: skip
SPECIMEN_WORDS = ("specimen", "sample", "probe", "proben", "eprouvette", "probeta", "provino")

UNITS: Mapping[Dimension, Mapping[str, float]] = MappingProxyType(
    {
        "strain": MappingProxyType(
            {"-": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "1": 1.0, "%": 1e-2, "‰": 1e-3, "µm/m": 1e-6,
             "µε": 1e-6, "με": 1e-6, "microstrain": 1e-6, "percent": 1e-2, "prozent": 1e-2, "fraction": 1.0}
        ),
        "stress": MappingProxyType(
            {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "hPa": 1e2, "KPa": 1e3, "kpa": 1e3, "Kpa": 1e3,
             "KPA": 1e3,
             "Mpa": 1e6, "MPA": 1e6, "PA": 1.0, "pa": 1.0, "N/mm2": 1e6, "N/m2": 1.0, "N/cm2": 1e4, "kN/m2": 1e3,
             "kN/mm2": 1e9, "mN/mm2": 1e3, "psi": 6894.757293168, "PSI": 6894.757293168, "ksi": 6894757.293168,
             "bar": 1e5, "mbar": 1e2, "kgf/cm2": 98066.5, "kgf/mm2": 9806650.0, "kg/cm2": 98066.5,
             "gf/mm2": 9806.65, "g/mm2": 9806.65, "dyn/cm2": 0.1, "pascal": 1.0, "МПа": 1e6, "кПа": 1e3, "Па": 1.0}
        ),
        "force": MappingProxyType(
            {"N": 1.0, "mN": 1e-3, "µN": 1e-6, "uN": 1e-6, "kN": 1e3, "KN": 1e3, "MN": 1e6, "cN": 1e-2, "daN": 10.0,
             "lbf": 4.4482216152605, "lb": 4.4482216152605, "lbs": 4.4482216152605, "kgf": 9.80665, "kg": 9.80665,
             "ozf": 0.27801385095378125, "oz": 0.27801385095378125,
             "gf": 9.80665e-3,
             "g": 9.80665e-3, "kp": 9.80665, "newton": 1.0, "newtons": 1.0, "kilonewton": 1e3, "millinewton": 1e-3,
             "Н": 1.0, "кН": 1e3}
        ),
        "length": MappingProxyType(
            {"mm": 1e-3, "MM": 1e-3, "cm": 1e-2, "m": 1.0, "µm": 1e-6, "um": 1e-6, "nm": 1e-9, "in": 25.4e-3,
             "inch": 25.4e-3, "inches": 25.4e-3, '"': 25.4e-3, "mil": 25.4e-6, "millimeter": 1e-3, "millimetre": 1e-3,
             "millimeters": 1e-3, "micron": 1e-6, "microns": 1e-6, "мм": 1e-3}
        ),
        "area": MappingProxyType({"mm2": 1e-6, "cm2": 1e-4, "m2": 1.0, "in2": 645.16e-6, "µm2": 1e-12}),
        "time": MappingProxyType(
            {"s": 1.0, "S": 1.0, "sec": 1.0, "Sec": 1.0, "secs": 1.0, "sek": 1.0, "Sek": 1.0, "ms": 1e-3,
             "min": 60.0, "second": 1.0, "seconds": 1.0, "с": 1.0, "秒": 1.0,
             "h": 3600.0}
        ),
    }
)  # fmt: skip
"""Units of each dimension and their factors to SI. ``mPa`` is missing: it is as often MPa as what it says."""

DIMENSION_OF: Mapping[Quantity, Dimension] = MappingProxyType(
    {
        "strain": "strain",
        "stress": "stress",
        "force": "force",
        "extension": "length",
        "position": "length",
        "height": "length",
        "time": "time",
    }
)
