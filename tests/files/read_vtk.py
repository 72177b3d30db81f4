"""Prints what VTK reads from files: `python3 read_vtk.py FILE...`."""

import sys

import vtk


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


def tuples(array):
    return [x for k in range(array.GetNumberOfTuples()) for x in array.GetTuple(k)]


def show(data, attributes):
    for k in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(k)
        keys = array.GetInformation()
        unit = keys.Get(array.UNITS_LABEL()) if keys.Has(array.UNITS_LABEL()) else ""
        print(f"{array.GetName()} [{unit}] {array.GetDataTypeAsString()}: {numbers(tuples(array))}")
    fields = data.GetFieldData()
    for k in range(fields.GetNumberOfArrays()):
        words = fields.GetAbstractArray(k)
        print(f"{words.GetName()}: {' '.join(words.GetValue(n) for n in range(words.GetNumberOfValues()))}")


for path in sys.argv[1:]:
    reader = {"vtp": vtk.vtkXMLPolyDataReader, "vti": vtk.vtkXMLImageDataReader, "ply": vtk.vtkPLYReader}[path[-3:]]()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    print(f"{path[-3:]}: {data.GetNumberOfPoints()} points, {data.GetNumberOfCells()} cells")
    print(f"bounds {numbers(data.GetBounds())}")
    if path.endswith("vti"):
        show(data, data.GetCellData())
    else:
        if data.GetNumberOfCells():
            mass = vtk.vtkMassProperties()
            mass.SetInputData(data)
            print(f"volume {mass.GetVolume():.6g}")
        if path.endswith("vtp"):
            show(data, data.GetPointData())
