# SPDX-License-Identifier: Apache-2.0
"""Two volume mappers of VTK behind one function: a frame, and the milliseconds that it took."""
import time

import numpy as np
import vtkmodules.all as vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def makeImage(scene):
    # VTK's voxels are points; blockwalk's first voxel has its centre half a voxel inside the volume's corner.
    image = vtk.vtkImageData()
    image.SetDimensions(*scene.dims())
    image.SetSpacing(*[scene.spacing] * 3)
    image.SetOrigin(*[scene.spacing / 2] * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(scene.voxels.ravel(), deep=False))
    return image


def makeProperty(scene, linear):
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    points = [point.split(":") for point in scene.transfer.split(",")]
    # Empty voxels are not shown, even where the first point's opacity is above 0.
    opacity.AddPoint(scene.empty, 0)
    for value, rgb, alpha in points:
        color.AddRGBPoint(float(value), *[int(rgb[i:i + 2], 16) / 255 for i in (0, 2, 4)])
        opacity.AddPoint(float(value), float(alpha))
    look = vtk.vtkVolumeProperty()
    look.SetColor(color)
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(scene.spacing)
    look.SetInterpolationType(vtk.VTK_LINEAR_INTERPOLATION if linear else vtk.VTK_NEAREST_INTERPOLATION)
    look.ShadeOff()
    return look


class Mapper:
    def __init__(self, kind, scene, linear, size, step, view, threads):
        self.mapper = (vtk.vtkFixedPointVolumeRayCastMapper if kind == "fixed" else vtk.vtkOpenGLGPUVolumeRayCastMapper)()
        self.image = makeImage(scene)
        self.mapper.SetInputData(self.image)
        self.mapper.SetAutoAdjustSampleDistances(False)
        self.mapper.SetSampleDistance(step * scene.spacing)
        if kind == "fixed":
            self.mapper.SetNumberOfThreads(threads)
            self.mapper.SetInteractiveSampleDistance(step * scene.spacing)
            self.mapper.SetImageSampleDistance(1)
        else:
            self.mapper.SetImageSampleDistance(1)
            self.mapper.SetUseJittering(False)
        volume = vtk.vtkVolume()
        volume.SetMapper(self.mapper)
        volume.SetProperty(makeProperty(scene, linear))
        renderer = vtk.vtkRenderer()
        renderer.AddVolume(volume)
        renderer.SetBackground(0, 0, 0)
        self.camera = renderer.GetActiveCamera()
        self.camera.SetPosition(*view["eye"])
        self.camera.SetFocalPoint(*view["target"])
        self.camera.SetViewUp(*view["up"])
        self.camera.SetViewAngle(view["fov"])
        renderer.ResetCameraClippingRange()
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(size, size)
        self.window.AddRenderer(renderer)

    def frame(self):
        self.camera.Modified()
        begun = time.perf_counter()
        self.window.Render()
        self.window.WaitForCompletion()
        return 1000 * (time.perf_counter() - begun)

    def pixels(self):
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.SetInputBufferTypeToRGB()
        grab.Update()
        width, height, _ = grab.GetOutput().GetDimensions()
        rows = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(height, width, 3)
        return np.flipud(rows)


def writePng(path, pixels):
    image = vtk.vtkImageData()
    height, width, _ = pixels.shape
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(np.flipud(pixels)).reshape(-1, 3), deep=True))
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.Write()
