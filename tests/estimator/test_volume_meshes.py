"""Volume meshes of other programs: none silently empty, doubled, mirrored or inside out."""

import re
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.meshes.elements import point_volumes
from estimator.meshes.outside import outer_surface
from estimator.meshes.reading import read_volume_mesh, volume_m3
from estimator.meshes.volume_mesh import CellKind, VolumeMesh
from estimator.meshes.writing import write_mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHARED = 0.35  # of the volume that is tumour
MESHIO: dict[str, CellKind] = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "pyramid": "pyramid5",
    "wedge": "wedge6",
    "hexahedron": "hex8",
}
TET = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A box of 1 x 0.6 x 0.4 m by Gmsh in every format and order, with groups that overlap and one of faces."""
    folder = tmp_path_factory.mktemp("gmsh")
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("box")
        gmsh.model.occ.addBox(0, 0, 0, 1 - SHARED, 0.6, 0.4)
        gmsh.model.occ.addBox(1 - SHARED, 0, 0, SHARED, 0.6, 0.4)
        gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1, 2], name="tissue")
        gmsh.model.addPhysicalGroup(3, [2], name="tumour")
        (wall,) = (tag for dim, tag in gmsh.model.getEntitiesInBoundingBox(-1e-6, -1, -1, 1e-6, 2, 2, 2))
        gmsh.model.addPhysicalGroup(2, [wall], name="wall")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
        gmsh.model.mesh.generate(3)
        for order in (1, 2):
            gmsh.model.mesh.setOrder(order)
            for version, binary in ((2.2, 0), (2.2, 1), (4.1, 0), (4.1, 1)):
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.option.setNumber("Mesh.Binary", binary)
                gmsh.write(str(folder / f"msh {version}{' binary' * binary} {order}.msh"))
            gmsh.write(str(folder / f"med {order}.med"))
            gmsh.write(str(folder / f"inp {order}.inp"))
            gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    finally:
        gmsh.finalize()
    return folder


FORMS = ["msh 2.2", "msh 2.2 binary", "msh 4.1", "msh 4.1 binary", "med", "inp"]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("order", [1, 2])
def test_what_gmsh_writes_is_read_once_the_right_way_round_with_its_groups(
    written: Path, form: str, order: int
) -> None:
    (file,) = written.glob(f"{form} {order}.*")
    found = read_volume_mesh(file)
    kind: CellKind = "tet4" if order == 1 else "tet10"
    assert list(found.mesh.blocks) == [kind]
    assert volume_m3(found.mesh) == pytest.approx(0.24, rel=1e-9)
    assert point_volumes(found.mesh.points, kind, found.mesh.blocks[kind]).min() > 0
    shares = {
        name: point_volumes(
            found.mesh.points, kind, found.mesh.blocks[kind][found.mesh.members(name, kind)]
        ).sum()
        for name in ("tissue", "tumour")
    }
    assert shares == {"tissue": pytest.approx(0.24), "tumour": pytest.approx(SHARED * 0.24)}
    if form != "inp":  # Gmsh writes no set of nodes there
        assert found.mesh.points[found.mesh.node_sets["wall"]][:, 0] == pytest.approx(0.0)
    assert bool(found.repairs) == form.startswith("msh 2.2")
    assert all("stand there twice" in repair for repair in found.repairs)


@pytest.mark.parametrize("binary", [0, 1])
def test_elements_in_no_group_are_read_from_msh_as_well(tmp_path: Path, binary: int) -> None:
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 0.1, 0.1, 0.1)
        gmsh.model.occ.addBox(1, 0, 0, 0.1, 0.1, 0.2)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [2], name="tall")
        gmsh.model.mesh.generate(3)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.option.setNumber("Mesh.SaveParametric", 1)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    found = read_volume_mesh(tmp_path / "a.msh").mesh
    assert volume_m3(found) == pytest.approx(3e-3)
    tall = found.blocks["tet4"][found.members("tall", "tet4")]
    assert point_volumes(found.points, "tet4", tall).sum() == pytest.approx(2e-3)


@pytest.mark.parametrize("suffix", [".vtu", ".msh", ".inp"])
@pytest.mark.parametrize("order", [1, 2])
def test_a_round_trip_by_meshio_and_one_by_ourselves_keep_everything(
    written: Path, tmp_path: Path, suffix: str, order: int
) -> None:
    mesh = read_volume_mesh(written / f"msh 4.1 {order}.msh").mesh
    file = tmp_path / f"out{suffix}"
    write_mesh(mesh, file)
    again = read_volume_mesh(file)
    assert again.repairs == ()
    assert_same(again.mesh, mesh)
    assert set(again.mesh.regions) == set(mesh.regions)
    assert set(again.mesh.node_sets) == set(mesh.node_sets)
    theirs = meshio.read(file)
    blocks = [block for block in theirs.cells if block.type in MESHIO]
    cells = np.concatenate([block.data for block in blocks])
    kind = MESHIO[blocks[0].type]
    assert point_volumes(theirs.points, kind, cells).sum() == pytest.approx(0.24, rel=1e-6)
    assert theirs.points[cells].mean(axis=1)[
        np.lexsort(theirs.points[cells].mean(axis=1).T)
    ] == pytest.approx(sorted_centres(mesh), rel=1e-6)


def sorted_centres(mesh: VolumeMesh) -> FloatArray:
    centres = np.concatenate([mesh.points[cells].mean(axis=1) for cells in mesh.blocks.values()])
    return np.asarray(centres[np.lexsort(centres.T)])


def assert_same(one: VolumeMesh, other: VolumeMesh) -> None:
    assert set(one.blocks) == set(other.blocks)
    assert volume_m3(one) == pytest.approx(volume_m3(other), rel=1e-9)
    assert sorted_centres(one) == pytest.approx(sorted_centres(other), rel=1e-9, abs=1e-12)
    for name in other.regions:
        for kind in other.blocks:
            assert one.members(name, kind).sum() == other.members(name, kind).sum()


@pytest.mark.parametrize("order", [1, 2])
def test_gmsh_reads_what_is_written_as_msh(written: Path, tmp_path: Path, order: int) -> None:
    mesh = read_volume_mesh(written / f"med {order}.med").mesh
    write_mesh(mesh, tmp_path / "out.msh")
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "out.msh"))
        kind = 4 if order == 1 else 11
        points, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss4")
        _, determinants, _ = gmsh.model.mesh.getJacobians(kind, points)
        names = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()}
    finally:
        gmsh.finalize()
    assert names == {"tissue", "tumour", "wall"}
    assert determinants.min() > 0
    assert (determinants.reshape(-1, len(weights)) * weights).sum() == pytest.approx(0.24, rel=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_a_febio_model_holds_every_node_and_element(written: Path, tmp_path: Path, order: int) -> None:
    mesh = read_volume_mesh(written / f"msh 4.1 {order}.msh").mesh
    write_mesh(mesh, tmp_path / "out.feb")
    root = ElementTree.parse(tmp_path / "out.feb").getroot()
    points = np.array(
        [[float(x) for x in (node.text or "").split(",")] for node in root.iterfind("Mesh/Nodes/node")]
    )
    cells = (
        np.array([(one.text or "").split(",") for one in root.iterfind("Mesh/Elements/elem")], dtype=int) - 1
    )
    assert {one.get("type") for one in root.iterfind("Mesh/Elements")} == {"tet4" if order == 1 else "tet10"}
    assert point_volumes(points, "tet4" if order == 1 else "tet10", cells).sum() == pytest.approx(
        0.24, rel=1e-9
    )
    tumour = root.find("Mesh/ElementSet[@name='tumour']")
    assert tumour is not None
    (inside,) = mesh.regions["tumour"].values()
    assert len((tumour.text or "").split(",")) == inside.sum()


SHAPES: dict[CellKind, tuple[str, FloatArray, float]] = {
    "tet4": ("tetra", TET, 1e-3 / 6),
    "pyramid5": (
        "pyramid",
        0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]]),
        1e-3 / 3,
    ),
    "wedge6": (
        "wedge",
        0.1 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]),
        5e-4,
    ),
    "hex8": (
        "hexahedron",
        0.1
        * np.array(
            [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
        ),
        1e-3,
    ),
}


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("suffix", [".vtu", ".msh", ".inp"])
def test_every_kind_of_element_has_its_volume_and_surface(
    tmp_path: Path, kind: CellKind, suffix: str
) -> None:
    name, points, volume = SHAPES[kind]
    meshio.Mesh(points, [(name, np.arange(len(points))[None])]).write(tmp_path / "one.vtu")
    mesh = read_volume_mesh(tmp_path / "one.vtu").mesh
    write_mesh(mesh, tmp_path / f"again{suffix}")
    found = read_volume_mesh(tmp_path / f"again{suffix}")
    assert found.repairs == ()
    assert volume_m3(found.mesh) == pytest.approx(volume, rel=1e-9)
    assert outer_surface(found.mesh, "one").surface.volume_m3 == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("kind", SHAPES)
def test_elements_that_are_inside_out_are_turned(tmp_path: Path, kind: CellKind) -> None:
    name, points, volume = SHAPES[kind]
    meshio.Mesh(points * (1, 1, -1), [(name, np.arange(len(points))[None])]).write(tmp_path / "one.vtu")
    found = read_volume_mesh(tmp_path / "one.vtu")
    assert volume_m3(found.mesh) == pytest.approx(volume, rel=1e-9)
    assert found.repairs == (f"turned all {kind}, which were inside out",)


def tet10(points: FloatArray = TET) -> FloatArray:
    return np.vstack(
        [points, [(points[a] + points[b]) / 2 for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]]
    )


@pytest.mark.parametrize(
    "order", [[0, 1, 2, 3, 4, 5, 9, 7, 8, 6], [0, 1, 2, 3, 9, 8, 7, 6, 5, 4], [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
)
def test_middle_nodes_in_another_order_are_put_in_order(tmp_path: Path, order: list[int]) -> None:
    meshio.Mesh(tet10(), [("tetra10", np.array([order]))]).write(tmp_path / "one.vtu")
    found = read_volume_mesh(tmp_path / "one.vtu")
    assert found.repairs == ("put the middle nodes of 1 tet10 in order",)
    assert found.mesh.points[found.mesh.blocks["tet10"][0]] == pytest.approx(tet10())


def test_a_curved_tet10_keeps_its_curve(tmp_path: Path) -> None:
    points = tet10()
    points[5] += (0.01, 0.01, 0)
    meshio.Mesh(points, [("tetra10", np.arange(10)[None])]).write(tmp_path / "one.vtu")
    found = read_volume_mesh(tmp_path / "one.vtu")
    assert found.repairs == ()
    assert found.mesh.points[found.mesh.blocks["tet10"][0]] == pytest.approx(points)
    assert volume_m3(found.mesh) > 1e-3 / 6 * 1.05


PARTS = """*HEADING
two parts whose nodes have the same numbers
*PART, NAME=Liver
*NODE
1, 0, 0, 0
2, 100, 0, 0
3, 0, 100, 0
4, 0, 0, 100
*ELEMENT, TYPE=C3D4, ELSET=tissue
1, 1, 2,
3, 4
*END PART
*PART, NAME="Cube"
*NODE
1, 0, 0, 0
2, 20, 0, 0
3, 20, 20, 0
4, 0, 20, 0
5, 0, 0, 20
6, 20, 0, 20
7, 20, 20, 20
8, 0, 20, 20
*ELEMENT, TYPE=C3D8R
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELSET, ELSET=stiff, GENERATE
1, 1, 1
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=Liver-1, PART=Liver
*END INSTANCE
** a quarter turn about z after the shift
*INSTANCE, NAME=Cube-1, PART=Cube
200, 0, 0
0, 0, 0, 0, 0, 1, 90
*END INSTANCE
*NSET, NSET=base, INSTANCE=Liver-1
1, 2, 3
*ELSET, ELSET=both, INSTANCE=Liver-1
1
*ELSET, ELSET=both, INSTANCE=Cube-1
1
*END ASSEMBLY
"""


def test_parts_and_instances_of_abaqus_stand_where_they_are_put(tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_text(PARTS)
    found = read_volume_mesh(tmp_path / "a.inp", "mm")
    assert volume_m3(found.mesh) == pytest.approx(1e-3 / 6 + 8e-6)
    cube = found.mesh.points[found.mesh.blocks["hex8"][0]]
    assert (cube.min(axis=0), cube.max(axis=0)) == (
        pytest.approx([-0.02, 0.2, 0.0]),
        pytest.approx([0.0, 0.22, 0.02]),
    )
    assert found.mesh.points[found.mesh.blocks["tet4"][0]] == pytest.approx(TET)
    assert {
        name: sum(one.sum() for one in inside.values()) for name, inside in found.mesh.regions.items()
    } == {
        "Liver-1.tissue": 1,
        "Cube-1.stiff": 1,
        "both": 2,
    }
    assert found.mesh.points[found.mesh.node_sets["base"]] == pytest.approx(TET[:3])


def test_a_part_that_stands_twice_is_two_bodies_and_in_one_place_it_is_refused(tmp_path: Path) -> None:
    again = PARTS.replace(
        "** a quarter", "*INSTANCE, NAME=Liver-2, PART=Liver\n300, 0, 0\n*END INSTANCE\n** a quarter"
    )
    (tmp_path / "a.inp").write_text(again)
    assert len(read_volume_mesh(tmp_path / "a.inp", "mm").mesh.blocks["tet4"]) == 2
    (tmp_path / "b.inp").write_text(again.replace("300, 0, 0\n", ""))
    with pytest.raises(
        InputError, match=r"1 elements fill the space of others, the first about .* the body is there twice"
    ):
        read_volume_mesh(tmp_path / "b.inp", "mm")


def test_included_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "nodes.inc").write_text("*NODE\n1,0,0,0\n2,.1,0,0\n3,0,.1,0\n4,0,0,.1\n")
    (tmp_path / "a.inp").write_text("*HEADING\n*INCLUDE, INPUT=nodes.inc\n*ELEMENT, TYPE=C3D4H\n1,1,2,3,4\n")
    assert volume_m3(read_volume_mesh(tmp_path / "a.inp").mesh) == pytest.approx(1e-3 / 6)


def test_med_files_of_meshio_are_turned_and_it_is_told(tmp_path: Path) -> None:
    meshio.Mesh(TET, [("tetra", np.arange(4)[None])]).write(tmp_path / "a.med")
    found = read_volume_mesh(tmp_path / "a.med")
    assert volume_m3(found.mesh) == pytest.approx(1e-3 / 6)
    assert found.repairs == ("turned all tet4, which were inside out",)


def refusals(folder: Path) -> dict[str, tuple[Path, str]]:
    def by_meshio(name: str, points: FloatArray, *cells: tuple[str, list[list[int]]]) -> Path:
        meshio.Mesh(points, [(kind, np.array(one)) for kind, one in cells]).write(folder / name)
        return folder / name

    head = "*NODE\n1,0,0,0\n2,.1,0,0\n3,0,.1,0\n4,0,0,.1\n"
    texts = {
        "missing": f"{head}*ELEMENT, TYPE=C3D4\n1,1,2,3,9\n",
        "generated": f"*HEADING\n*NGEN\n1,2\n{head}",
        "twenty": f"{head}*ELEMENT, TYPE=C3D20\n1,1,2,3,4\n",
        "cut": f"{head}*ELEMENT, TYPE=C3D10\n1,1,2,3,4\n",
        "shells": f"{head}*ELEMENT, TYPE=S3\n1,1,2,3\n",
        "no part": "*HEADING\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*END ASSEMBLY\n",
        "words": "*NODE\n1,0,0,x\n",
        "circle": "*INCLUDE, INPUT=circle.inp\n",
    }
    for name, text in texts.items():
        (folder / f"{name}.inp").write_text(text)
    (folder / "cut.msh").write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1")
    (folder / "cut.med").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(40))
    (folder / "cut.vtu").write_text('<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece>')
    (folder / "surface.stl").write_text("solid\nendsolid\n")
    folded = SHAPES["hex8"][1][[0, 1, 3, 2, 4, 5, 6, 7]]
    twice = np.vstack([TET, TET])
    return {
        "faces alone": (by_meshio("t.vtu", TET, ("triangle", [[0, 1, 2]])), "holds no volume elements"),
        "folded": (
            by_meshio("f.vtu", folded, ("hexahedron", [list(range(8))])),
            "1 hex8 are folded, the first number 0",
        ),
        "flat": (by_meshio("z.vtu", TET * (1, 1, 0), ("tetra", [[0, 1, 2, 3]])), "1 tet4 are without volume"),
        "doubled": (
            by_meshio("d.vtu", twice, ("tetra", [[0, 1, 2, 3], [4, 5, 6, 7]])),
            "the body is there twice",
        ),
        "not finite": (
            by_meshio("n.vtu", TET * (1, 1, np.nan), ("tetra", [[0, 1, 2, 3]])),
            "has no finite place",
        ),
        "quadratic hexahedra": (
            by_meshio("q.vtu", np.random.default_rng(0).random((20, 3)), ("hexahedron20", [list(range(20))])),
            "has elements of kind hexahedron20",
        ),
        "a node that is missing": (folder / "missing.inp", "element 1 names node 9, which there is not"),
        "generated nodes": (folder / "generated.inp", "line 2: \\*NGEN is not read"),
        "C3D20": (folder / "twenty.inp", "elements of type C3D20; read are C3D4"),
        "an element cut short": (folder / "cut.inp", "its last element is cut short"),
        "shells": (folder / "shells.inp", "holds no volume elements"),
        "an instance of nothing": (folder / "no part.inp", "is of part P, which there is not"),
        "no number": (folder / "words.inp", "cannot be read as an Abaqus input file"),
        "files in a circle": (folder / "circle.inp", "files include each other without end"),
        "MSH cut short": (folder / "cut.msh", "cannot be read as MSH"),
        "MED cut short": (folder / "cut.med", "cannot be read as MED"),
        "VTU cut short": (folder / "cut.vtu", "cannot be read as VTU"),
        "another kind": (folder / "surface.stl", "is no mesh in MSH, VTU, INP or MED"),
    }


@pytest.mark.parametrize(
    "what",
    [
        "faces alone",
        "folded",
        "flat",
        "doubled",
        "not finite",
        "quadratic hexahedra",
        "a node that is missing",
        "generated nodes",
        "C3D20",
        "an element cut short",
        "shells",
        "an instance of nothing",
        "no number",
        "files in a circle",
        "MSH cut short",
        "MED cut short",
        "VTU cut short",
        "another kind",
    ],
)
def test_a_mesh_that_cannot_be_is_refused_in_one_line(tmp_path: Path, what: str) -> None:
    file, told = refusals(tmp_path)[what]
    with pytest.raises(InputError) as refused:
        read_volume_mesh(file)
    assert re.search(told, str(refused.value))
    assert str(tmp_path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_surface_of_a_region_is_closed(written: Path) -> None:
    mesh = read_volume_mesh(written / "msh 4.1 2.msh").mesh
    assert outer_surface(mesh, "box").surface.volume_m3 == pytest.approx(0.24)
    assert outer_surface(mesh, "box", "tumour").surface.volume_m3 == pytest.approx(SHARED * 0.24)
