/// The nodes of files for 3D printers: objects that hold meshes and places of others, shared wherever they are placed.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/math/Types.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

struct PrintedObject;

/// An object in another one, or in the whole.
struct PrintedPlace {
    std::string name;
    PrintedObject* object = nullptr;
    Affine3d map;
};

struct PrintedObject {
    struct Mesh {
        std::string name, mesh, material;  ///< of its node, and in the plain scene
    };
    std::string name;
    bool isHidden = false;  ///< behind a Switch
    std::vector<Mesh> meshes;
    std::vector<PrintedPlace> places;
    // Once it is written:
    std::string definition;  ///< empty: nothing is in it, or its mesh alone
    double nodes = 0;        ///< below each that is placed; may be more than any machine has
    std::size_t depth = 0;   ///< levels of these
    enum class State : std::uint8_t { kNew, kOpen, kCounted } state = State::kNew;

    [[nodiscard]] bool isMeshAlone() const { return meshes.size() == 1 && places.empty() && !isHidden; }
    [[nodiscard]] bool isEmpty() const { return meshes.empty() && places.empty(); }
};

struct PrintedMaterial {
    std::string name;
    std::uint32_t color = 0xffffffff;  ///< 0xRRGGBBAA, sRGB
    std::string image;                 ///< of the plain scene, or empty
    bool isTranslucent = false, hasTwoSides = false;
};

class PrintedNodes {
public:
    PrintedNodes(PlainScene& scene, const ReadLimits& limits) : scene_(scene), limits_(limits) {}

    /// It stays where it is.
    [[nodiscard]] PrintedObject& addObject(const std::string& name);
    void addMesh(PrintedObject& object, const std::string& name, MeshData mesh, const std::string& material);
    /// Its name, which is made another one where there is such.
    [[nodiscard]] std::string addMaterial(const PrintedMaterial& material);
    /// The node that holds all, in metres.
    [[nodiscard]] proto::scene::Node& addRoot(const std::string& name, double unitMetres);

    /// Of these places those whose object is in no other one, and of each circle that nothing else holds the first.
    static void dropPlacedElsewhere(std::vector<PrintedPlace>& places);
    /// Writes what is placed there, a Definition for each object that is more than a mesh. Circles are cut, and noted.
    /// kLimit: there would be more nodes or levels than a scene may have; nothing is written then.
    [[nodiscard]] Expected<void> place(const std::vector<PrintedPlace>& places, proto::scene::Node& parent);

private:
    /// What is reached from here and new, each after what is in it.
    [[nodiscard]] std::vector<PrintedObject*> orderFrom(PrintedObject& object);
    void write(PrintedObject& object);
    static void write(const std::vector<PrintedPlace>& places, const std::function<proto::scene::Node*()>& make);

    PlainScene& scene_;
    const ReadLimits& limits_;
    std::deque<PrintedObject> objects_;
    std::map<std::string, std::size_t> materials_;  ///< how often each name came
    std::size_t meshes_ = 0, definitions_ = 0;
};

/// How many objects, volumes and other resources a file may have: each may take some three kilobytes and 20
/// microseconds, however few letters it is, and of an archive next to none.
[[nodiscard]] std::size_t mostPrintedResources(const ReadLimits& limits, std::size_t fileBytes, bool isArchive);

/// Whether it keeps bodies bodies: its inverse exists, and has numbers that are worth something.
[[nodiscard]] bool isRegular(const Affine3d& map);

}  // namespace tessera
