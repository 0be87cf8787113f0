/// The city in OpenSceneGraph, in a window of its own, as one who knows it would build it. A program of its own: it
/// brings libGL, which must not meet OSMesa in one process. Wants a display: `xvfb-run`.
///
///     bench_drawing_osg default|queries FRAMES      # "frame N" on the standard input: answers with its milliseconds
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/MatrixTransform>
#include <osg/OcclusionQueryNode>
#include <osg/StateSet>
#include <osgViewer/Viewer>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/bench/DrawingCity.h"

namespace tessera::bench {
namespace {

osg::ref_ptr<osg::Geometry> toOsg(const MeshData& mesh) {
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    osg::ref_ptr<osg::Vec3Array> positions = new osg::Vec3Array, normals = new osg::Vec3Array;
    for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
        positions->push_back({mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]});
        normals->push_back({mesh.normals[i], mesh.normals[i + 1], mesh.normals[i + 2]});
    }
    geometry->setVertexArray(positions);
    geometry->setNormalArray(normals, osg::Array::BIND_PER_VERTEX);
    geometry->addPrimitiveSet(
        new osg::DrawElementsUInt(GL_TRIANGLES, static_cast<unsigned>(mesh.indices.size()), mesh.indices.data()));
    geometry->setUseVertexBufferObjects(true);
    geometry->setUseDisplayList(false);
    return geometry;
}

osg::Matrixd toOsg(const Mat4d& m) {
    return {m(0, 0), m(1, 0), m(2, 0), m(3, 0), m(0, 1), m(1, 1), m(2, 1), m(3, 1),
            m(0, 2), m(1, 2), m(2, 2), m(3, 2), m(0, 3), m(1, 3), m(2, 3), m(3, 3)};
}

/// Blocks of the streets are groups, as an author would make them: its culling is hierarchical then.
osg::ref_ptr<osg::Group> build(bool queries) {
    const City city = makeCity();
    std::vector<osg::ref_ptr<osg::Geode>> geodes;
    for (const MeshData& mesh : city.meshes) {
        geodes.emplace_back(new osg::Geode);
        geodes.back()->addDrawable(toOsg(mesh));
    }
    osg::ref_ptr<osg::Group> root = new osg::Group;
    root->getOrCreateStateSet()->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
    osg::Group* block = nullptr;
    for (const City::Place& place : city.places) {
        if (place.mesh == 0) root->addChild(block = new osg::Group);
        osg::ref_ptr<osg::MatrixTransform> at =
            new osg::MatrixTransform(osg::Matrixd::scale(place.size.x(), place.size.y(), place.size.z()) *
                                     osg::Matrixd::translate(place.at.x(), place.at.y(), place.at.z()));
        at->addChild(geodes[place.mesh]);
        if (queries) {
            osg::ref_ptr<osg::OcclusionQueryNode> asked = new osg::OcclusionQueryNode;
            asked->addChild(at);
            block->addChild(asked);
        } else {
            block->addChild(at);
        }
    }
    return root;
}

int serve(int argc, char** argv) {
    const bool queries = argc > 1 && std::strcmp(argv[1], "queries") == 0;
    const int frames = argc > 2 ? std::atoi(argv[2]) : 1;
    osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
    traits->readDISPLAY();
    traits->setUndefinedScreenDetailsToDefaultScreen();
    traits->width = 1920;
    traits->height = 1080;
    traits->samples = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 4;
    traits->sampleBuffers = traits->samples > 0 ? 1 : 0;
    traits->doubleBuffer = true;
    traits->vsync = false;
    const osg::ref_ptr<osg::GraphicsContext> window = osg::GraphicsContext::createGraphicsContext(traits);
    if (!window || !window->valid()) {
        std::fprintf(stderr, "bench_drawing_osg: no window of 1920x1080 with 4 samples\n");
        return 1;
    }
    osgViewer::Viewer viewer;
    viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
    osg::Camera* camera = viewer.getCamera();
    camera->setGraphicsContext(window);
    camera->setViewport(0, 0, 1920, 1080);
    camera->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
    viewer.setSceneData(build(queries));
    viewer.realize();
    const auto show = [&](double t) {
        const ScreenCamera view = screenCamera(benchScreen(), User(), Eye::kCenter, cityView(t));
        camera->setProjectionMatrix(toOsg(view.clip_T_eye));
        camera->setViewMatrix(toOsg(view.eye_T_world.matrix()));
        viewer.frame();
    };
    for (int i = 0; i < 3; ++i) show(0);
    std::printf("ready\n");
    std::fflush(stdout);
    int frame = 0;
    while (std::scanf(" frame %d", &frame) == 1) {
        const auto start = std::chrono::steady_clock::now();
        show(static_cast<double>(frame) / frames);
        const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
        std::printf("%.17g\n", taken.count());
        std::fflush(stdout);
    }
    return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::serve(argc, argv);
}
