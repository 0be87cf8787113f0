/// One walk through a graph of Coin: nodes of the plain scene, in the order of the file.
#pragma once

#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/nodes/SoNode.h>

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/math/Box.h"
#include "server/import/coin/CoinFiles.h"
#include "server/import/coin/CoinMaterials.h"
#include "server/import/coin/CoinMorphs.h"
#include "server/import/coin/CoinMotion.h"
#include "server/import/coin/CoinNormals.h"
#include "server/import/coin/CoinShapes.h"
#include "server/import/reader/CountedNotes.h"
#include "server/import/reader/PlainScene.h"

class SoGroup;
class SoVRMLShape;
class SoVRMLTransform;
class SoVRMLViewpoint;

namespace tessera {

/// Coin keeps the state (materials, coordinates, transforms that are in force): each node that is placed here begins
/// with a model matrix of identity there. Children of switches and levels of detail are all walked.
class CoinWalk {
public:
    /// `textBytes`: of the file, unpacked.
    CoinWalk(const std::string& path, std::size_t textBytes, const ReadLimits& limits, CoinFiles& files,
             PlainScene& scene);

    /// Once.
    Expected<void> walk(SoNode& root);

private:
    using Message = proto::scene::Node;
    /// A node of the plain scene whose children are being made.
    struct Place {
        std::function<Message*()> make;
        std::string path;  ///< from the top of the file, "/a/b"
        Affine3d world = Affine3d::Identity();
        std::set<std::string>* names = nullptr;  ///< of the children, each once
        std::size_t depth = 0;
    };
    /// A node that was made, and what its children need.
    struct Opened {
        Message* node = nullptr;
        std::set<std::string> names;
        Place place;
    };

    Expected<void> visit(SoNode& node, Place& at);
    Expected<void> visitKnown(SoNode& node, Place& at);
    Expected<void> visitChildren(SoNode& node, Place& in);
    Expected<void> addGroup(SoNode& node, Place& at);
    Expected<void> addTransform(SoVRMLTransform& node, Place& at);
    Expected<void> addSwitch(SoNode& node, Place& at);
    Expected<void> addLevels(SoNode& node, Place& at);
    Expected<void> addCopies(SoNode& node, Place& at);
    Expected<void> addFile(SoNode& node, const std::vector<std::string>& names, Place& at);
    Expected<void> addVrmlShape(SoVRMLShape& shape, Place& at);
    Expected<void> addShape(SoNode& shape, Place& at);
    /// What moves the vertices of a mesh, wherever it is shown.
    struct Morph {
        proto::scene::Skin skin;  ///< without mesh and material
        CoinMotion::Track track;
        std::size_t numbers = 0;  ///< vertices and targets: what each place takes
    };
    struct Part {
        std::string mesh, material;
        std::shared_ptr<const Morph> morph;  ///< null: nothing moves it
    };
    using Parts = std::vector<Part>;
    /// What a geometry is made of.
    struct Made {
        struct Mesh {
            std::string name;
            bool strokes = false;  ///< lines or points
            std::shared_ptr<const Morph> morph;
        };
        bool colored = false;
        std::vector<Mesh> meshes;
    };
    /// Holds what a geometry is made of. Whether its points move.
    bool holdGeometry(SoNode& geometry);
    Expected<Made> makeMoving(SoVRMLShape& shape, SoNode& geometry, bool textured, bool replaces);
    void addGeometry(const Part& part, Message& node);
    Expected<CoinShapes::Parts> partsOf(SoVRMLShape& shape, SoNode& geometry, bool textured, const SbMatrix& texture);
    Expected<CoinShapes::Parts> gather(SoNode& shape, const CoinShapes::Wanted& wanted, const PlainNormals& plain);
    Made nameMeshes(const SoNode& shape, CoinShapes::Parts parts, const CoinLook& look);
    Parts nameParts(const Made& made, CoinMaterials::Wanted wanted);
    Expected<void> placeParts(const SoNode& shape, const Parts& parts, Place& at);
    Expected<void> addText(const SoNode& text, const CoinMaterials::Wanted& wanted, Place& at);
    Expected<void> addLight(const SoNode& light, Place& at);
    Expected<void> addView(const SoNode& view, Place& at);
    void addBackground(const SoNode& node);
    /// Each of them becomes exactly one child, whatever it is.
    Expected<void> visitAsOne(SoNode& child, std::size_t index, Opened& in);

    /// A node at what Coin's model matrix says, which is identity from then on.
    Expected<Opened> open(const SoNode& node, const char* otherwise, Place& at);
    /// The same, and in it one that is nowhere else, whose transform moves.
    Expected<Opened> openMoving(const SoNode& node, const std::string& name, Place& at);
    Expected<Opened> openAt(const std::string& name, const Affine3d& map, Place& at);
    Message* make(const std::string& name, Place& at);
    /// kLimit: there are too many.
    Expected<void> takeNode();
    /// Of a file of our own the name that was wanted.
    [[nodiscard]] std::string freeName(const std::string& wanted, std::set<std::string>& names) const;
    /// Takes the list of a file of our own.
    void readOwnNames(const SoNode& root);
    /// What people call it; empty: nobody does.
    [[nodiscard]] std::string calledName(const SoNode& node);
    [[nodiscard]] Affine3d modelMatrix() const;
    void resetModelMatrix();
    std::string meshName(MeshData mesh);
    void leaveOut(const std::string& what, const SoNode& node);
    void noteWrong(const SoNode& node, const std::string& what);
    void finish();

    const ReadLimits& limits_;
    CoinFiles& files_;
    PlainScene& scene_;
    SoCallbackAction action_;
    CoinShapes shapes_;
    CoinMotion motion_;
    CoinMorphs morphs_;
    CoinMaterials materials_;
    SoNode* root_ = nullptr;
    Expected<void> result_;

    std::map<std::string, std::string> ownNames_;  ///< of what VRML has to call otherwise
    std::vector<std::string> fileNow_;             ///< the innermost file, by its real path, last
    std::set<const SoNode*> above_;                ///< whose children are walked now
    const SoNode* texture_ = nullptr;              ///< of Inventor, in force
    std::size_t nodes_ = 0, mostNodes_;

    std::map<std::string, Box> meshes_;      ///< bounds by name, which is made of the arrays' hash
    std::map<const SoNode*, Parts> shared_;  ///< of shapes of VRML 2, which look the same wherever they are
    /// Of their geometries, by how a picture lies on them.
    std::map<std::pair<const SoNode*, std::string>, Made> made_;
    std::size_t extrudedFaces_;  ///< that there is still room for
    std::size_t movingNumbers_;  ///< the same, in all places together
    std::size_t skins_ = 0;
    void extendBounds(const Box& box, const Affine3d& world);
    Box bounds_;
    /// Groups whose size counts, the innermost last, and what is in them.
    struct Measured {
        Affine3d group_T_world;
        Box box;
    };
    std::vector<Measured> measured_;
    struct View {
        Message* wall = nullptr;
        Affine3d world;
        double perDistance = 0, height = 0;
    };
    std::vector<View> views_;
    bool hasBackground_ = false;
    CountedNotes leftOut_;
};

/// What Coin calls a node's kind in files: "Box", "Separator"; of one that it does not know the file's own word.
[[nodiscard]] std::string kindOf(const SoNode& node);

}  // namespace tessera
