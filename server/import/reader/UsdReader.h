/// USD → plain scene: walks the composed stage and makes nodes of its prims.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/import/reader/GlyphPlaces.h"
#include "server/import/reader/ModelView.h"
#include "server/import/reader/PlainScene.h"
#include "server/import/reader/UsdMaterials.h"
#include "server/import/reader/UsdMeshes.h"
#include "server/import/reader/UsdTransforms.h"
#include "server/import/reader/usd/UsdStage.h"

namespace tessera {

class UsdReader {
public:
    UsdReader(UsdStage& stage, UsdFiles& files, UsdRemarks& remarks, const ReadLimits& limits)
        : stage_(stage),
          limits_(limits),
          remarks_(remarks),
          materials_(stage, files, limits, scene_, remarks),
          meshes_(stage, scene_, limits, materials_, remarks) {}

    [[nodiscard]] Expected<PlainScene> read();

private:
    using Node = proto::scene::Node;
    /// What prims have of those above.
    struct Above {
        std::function<Node*()> make;
        Affine3d world_T_parent = Affine3d::Identity();
        Affine3d parent_T_above = Affine3d::Identity();  ///< what stands between the node above and the prim above
        std::string material;                            ///< a path
        bool materialHolds = false;                      ///< whatever those below say
        std::shared_ptr<const UsdInherited> primvars;    ///< null: none
        std::string purpose = "default";
        bool moves = false, hidden = false;  ///< something above does, or is so
        std::size_t depth = 1;
    };

    Expected<void> setStage();
    Expected<void> walk(const UsdComposedPrim& prim, const Above& above);
    Expected<void> walkChildren(const UsdComposedPrim& prim, const Above& above);
    /// The node for a prim, where it stands.
    Node* place(const UsdComposedPrim& prim, const Above& above, Affine3d& world_T_prim);
    void placeSurface(const UsdPart& part, Node& node);
    Expected<void> addGeometry(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNodes);
    /// What is not shown, by its type; false: it may have something below.
    Expected<bool> isLeftOut(const UsdComposedPrim& prim, Above& inside);
    /// Whether there are children, and nothing but materials among them.
    Expected<bool> holdsLooksAlone(const UsdComposedPrim& prim);
    /// Whether a prim below has a purpose of its own, to be seen.
    Expected<bool> showsBelow(const UsdComposedPrim& prim, std::size_t depth);
    Expected<void> countNodes(std::size_t nodes);

    // UsdMotion.cpp
    void addKeys(const UsdComposedPrim& prim, const UsdTransform& transform, const Affine3d& parent_T_above,
                 Node& node);
    void addVisibility(const UsdComposedPrim& prim, const UsdAttribute& visibility, Node& node);
    void addAnimation();

    // UsdLights.cpp
    /// Whether the prim is a light. `ownNode`: what shines is a node below.
    Expected<bool> addLight(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNode);
    Expected<void> addDome(const UsdComposedPrim& prim, const Affine3d& world_T_prim, double strength,
                           const Vec3d& color);
    void addCameras();

    // UsdInstances.cpp
    /// `ownNodes`: what is shown are nodes below.
    Expected<void> addInstances(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNodes);
    struct Prototype {
        std::string definition;  ///< empty: nothing to be seen
        int number = 0;          ///< of the file's definitions
        std::size_t nodes = 0;
        Box bounds;
    };
    /// Its shapes, where they are simple enough for glyphs; else why not.
    [[nodiscard]] Expected<std::vector<GlyphPart>> glyphsOf(const proto::scene::Definition& definition) const;
    Expected<Prototype> prototype(const std::string& path, const Above& inside);

    UsdStage& stage_;
    const ReadLimits& limits_;
    UsdRemarks& remarks_;
    PlainScene scene_;
    UsdMaterials materials_;
    UsdMeshes meshes_;

    double metersPerUnit_ = 1;
    Box bounds_;
    std::size_t nodes_ = 0;
    ModelLight light_;
    struct Light {
        double intensity;
        Vec3d falloff;
        Vec3d at;
    };
    std::vector<Light> lights_;
    bool dome_ = false;
    struct Camera {
        UsdStage::Prim prim;
        Affine3d world_T_prim;
        Node* node;
    };
    std::vector<Camera> cameras_;
    /// A channel in time codes, until all are known.
    struct Channel {
        std::uint32_t key;
        std::string field;
        std::vector<double> times, values;
        bool steps = false;
    };
    std::vector<Channel> channels_;
    std::uint32_t keys_ = 0;
    std::size_t keysBetween_ = 100'000;            ///< that the file's samples have not: 8333 turns
    std::map<std::string, Prototype> prototypes_;  ///< by path, and the material above
    std::size_t prototypeNames_ = 0;
    std::set<std::string> openPrototypes_;
    /// Surfaces that stand at several places, with their definitions, once these have to be.
    std::map<const proto::scene::SubdivisionSurface*, std::string> surfaces_;
    std::size_t surfaceBytes_ = std::size_t{16} << 20;  ///< that surfaces may still be repeated in
    bool inPrototype_ = false;
};

}  // namespace tessera
