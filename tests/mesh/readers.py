"""Real readers of meshes: VTK's for its own formats, trimesh for all others."""

import io

import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader


def scene(data, format):
    """A file as trimesh has it."""
    if format in ("vtp", "vtu"):
        found = vtk(data, format)
        return trimesh.Scene(trimesh.Trimesh(points(found), corners(found), process=False))
    options = {"merge_primitives": True} if format in ("gltf", "glb") else {}
    return trimesh.load_scene(io.BytesIO(data), file_type=format, **options)


def vtk(data, format):
    """A file as VTK has it."""
    reader = {"vtp": vtkXMLPolyDataReader, "vtu": vtkXMLUnstructuredGridReader}[format]()
    reader.ReadFromInputStringOn()
    reader.SetInputString(data.decode())
    reader.Update()
    return reader.GetOutput()


def points(found):
    """The points of a file as VTK has it."""
    return vtk_to_numpy(found.GetPoints().GetData())


def corners(found):
    """The corners of its triangles."""
    cells = found.GetPolys() if hasattr(found, "GetPolys") else found.GetCells()
    return vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 3)


def arrays(data, format):
    """Arrays at points by name: of the first body of a GLB file, of all points in others."""
    if format in ("vtp", "vtu"):
        points = vtk(data, format).GetPointData()
        return {points.GetArrayName(i): vtk_to_numpy(points.GetArray(i)) for i in range(points.GetNumberOfArrays())}
    mesh, *_ = trimesh.load_scene(io.BytesIO(data), file_type=format, process=False).geometry.values()
    if format == "ply":
        table = mesh.metadata["_ply_raw"]["vertex"]["data"]
        return {name: table[name] for name in table.dtype.names}
    return {name.strip("_").lower(): values.ravel() for name, values in mesh.vertex_attributes.items()}
