"""Which cards of CalculiX are the project's laws.

Ours is W = μ w + λ/2 (J − 1)² of the full invariants. ``*HYPERELASTIC`` of CalculiX takes isochoric invariants and
(J − 1)²/D1, which is another law for tissue that changes its volume. ``*HYPERFOAM`` takes full stretches,

    W = Σ_i 2 μ_i/α_i² (λ1^α_i + λ2^α_i + λ3^α_i − 3 + (J^(−α_i β_i) − 1)/β_i),      β_i = ν_i/(1 − 2 ν_i),

and with three terms it is ours exactly. The first, α = 2 and ν = 0 (β → 0), is μ/2 (I1 − 3 − 2 ln J). The others have
α = −2 and the opposite coefficients λ and −λ, so that their stretches cancel; with ν = 1/3 and 1/4, β = 1 and 1/2, they
leave λ/2 (J² − 1) − λ (J − 1) = λ/2 (J − 1)².
"""

from dataclasses import dataclass

from estimator.materials.material import Material


@dataclass(frozen=True)
class Card:
    """The cards of a material, and in what it differs from ours; empty where it is the same law."""

    text: str
    differs: str = ""


def card_of(material: Material) -> Card | None:
    """Return a material's cards, None where CalculiX has no law that is near it."""
    mu, lame = material.lame
    bulk = lame + 2 * mu / 3
    match material.law.name:
        case "neo_hookean":
            return Card(_hyperfoam(mu, 2.0, lame))
        case "ogden1":
            (exponent,) = material.shape
            return Card(_hyperfoam(mu, float(exponent), lame))
        case "st_venant_kirchhoff":
            return Card(f"*ELASTIC\n{_line(material.youngs_modulus, material.poisson_ratio)}")
        case "mooney_rivlin":
            (share,) = material.shape
            numbers = _line(mu * (1 - share) / 2, mu * share / 2, 2 / bulk)
            return Card(
                f"*HYPERELASTIC, MOONEY-RIVLIN\n{numbers}",
                "CalculiX takes the isochoric invariants, ours are full: they part by terms in J − 1",
            )
    return None


def isochoric_neo_hookean(material: Material) -> Card:
    """Return the usual card: μ/2 (Ī1 − 3) + K/2 (J − 1)², the same for small strains alone."""
    mu, lame = material.lame
    numbers = _line(mu / 2, 2 / (lame + 2 * mu / 3))
    return Card(f"*HYPERELASTIC, NEO HOOKE\n{numbers}", "isochoric invariants, ours are full")


def _hyperfoam(mu: float, exponent: float, lame: float) -> str:
    terms = _line(mu, exponent, lame, -2.0, -lame, -2.0, 0.0, 1 / 3)
    return f"*HYPERFOAM, N=3\n{terms}\n{_line(0.25)}"


def _line(*numbers: float) -> str:
    # A field of more than twenty characters ends the reading with an error.
    return ", ".join(f"{number:.12g}" for number in numbers)
