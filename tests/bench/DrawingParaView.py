"""The tile display of ParaView, for pvpython: MESH PORT FRAMES. Says "ready", then answers "ANGLE" (degrees around the
mesh) with the milliseconds that the frame took until it stood on all tiles."""
import math
import sys
import time

from paraview import simple

mesh, port = sys.argv[1], int(sys.argv[2])
simple.Connect("localhost", port)
simple._DisableFirstRenderCameraReset()
reader = simple.PLYReader(FileNames=[mesh])
view = simple.CreateRenderView()
view.ViewSize = [800, 800]
view.RemoteRenderThreshold = 0
view.OrientationAxesVisibility = 0
normals = simple.GenerateSurfaceNormals(Input=reader)
simple.Show(normals, view)
layout = simple.CreateLayout(name="wall")
simple.AssignViewToLayout(view=view, layout=layout, hint=0)
view.CameraFocalPoint = [-0.0168, 0.1101, -0.0015]
view.CameraViewUp = [0, 1, 0]
view.CameraViewAngle = 36.87


def show(degrees):
    angle = math.radians(degrees)
    view.CameraPosition = [
        view.CameraFocalPoint[0] + 0.3 * math.sin(angle),
        view.CameraFocalPoint[1],
        view.CameraFocalPoint[2] + 0.3 * math.cos(angle),
    ]
    start = time.perf_counter()
    simple.Render(view)
    return 1e3 * (time.perf_counter() - start)


layout.ShowViewsOnTileDisplay()
for _ in range(5):
    show(0)
print("ready", flush=True)
for line in open(0):  # sys.stdin is ParaView's own here
    print(show(float(line)), flush=True)
