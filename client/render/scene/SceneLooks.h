/// What the drawables in use look like to a culler: mesh, transparency, whether they hide things. Knows who uses what,
/// so that a change finds those it concerns.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "client/render/DrawMaterial.h"
#include "client/render/scene/LookSources.h"
#include "client/render/scene/MeshCache.h"
#include "client/render/scene/SlotTable.h"
#include "common/cores/Material.h"

namespace tessera {

struct SceneLook {
    const RenderMesh* mesh = nullptr;  ///< as its fields say; null: its bytes are not here
    ObjectId material;
    std::shared_ptr<const DrawMaterial> drawn;  ///< it, as lists name it; null: there is none
    bool transparent = false;
    bool occludes = false;  ///< opaque in every pixel it covers
    bool detailed = false;  ///< images say more than colour and normals
    bool coated = false;    ///< has lacquer
    bool glossy = false;    ///< see DrawList
    MeshKind kind = MeshKind::kTriangles;
    float lineWidth = 0;          ///< pixels, of lines, those that stand for a surface or lie over it counted
    std::uint8_t lineLayers = 0;  ///< of those: as often they are drawn, passes counted
    bool cornersAlone = false;    ///< those of a surface are corners, no edges
    std::uint16_t state = 0;      ///< where it differs, a renderer must be told more than another material
    bool asWhole =
        false;  ///< its mesh's parts are not what is drawn: a program moves its vertices, or it is edges or corners
    std::int64_t fill = Material::kFilled;  ///< of triangles
    bool over = false;                      ///< opaque, and something blended is drawn over it
    bool coarser = false;                   ///< its material has another one for where it is small
    bool byScreen = false;                  ///< screens may draw it finer
    Fineness fineness;                      ///< of its mesh: see finenessOnScreens
    /// Where its material tells in depths alone, by holes that alpha cuts, a program, passes: a number that is another
    /// one as soon as any of that may be. Else 0.
    std::uint64_t cut = 0;
    double slack = 0;  ///< how far beyond the mesh's bounds it reaches then, or moved, in its own coordinates
};

/// Drawable cores, the materials that they name, and the images that those name.
class SceneLooks {
public:
    /// Remembers the core until `drop`.
    [[nodiscard]] SceneLook of(const Aspect& aspect, ObjectId core);
    /// The same with a material that is held, whatever its own is.
    [[nodiscard]] SceneLook of(const Aspect& aspect, ObjectId core, ObjectId held);
    /// A material is known, and told of by lookChanged by its own id, until it has been released as often.
    void hold(const Aspect& aspect, ObjectId material);
    void release(ObjectId material);
    /// Nobody uses the core any more. Its mesh stays until `endUpdate`. Unknown ones are allowed.
    void drop(ObjectId core);
    /// A drawable's arrays, or anything that makes a look, have new values: appends the known drawables whose look is
    /// another now, and held materials. Costs what is appended, and the materials of an image.
    void shapeChanged(const Aspect& aspect, ObjectId id, std::vector<ObjectId>& changed);
    void lookChanged(const Aspect& aspect, ObjectId id, std::vector<ObjectId>& changed);
    void clear();
    void endUpdate() { meshes_.dropUnused(); }

    /// A known drawable that screens may draw finer, by a copy of its core. Holds until it changes.
    [[nodiscard]] const Drawable& drawableByScreen(ObjectId core) const {
        return drawables_[drawables_.find(core)].kept;
    }
    struct Step {
        const RenderMesh* mesh = nullptr;
        double deviation = 0;  ///< see ScreenSteps
    };
    /// Of such a drawable, up to its finest: made when it is first asked for, kept for some looks. It may not be
    /// drawable.
    [[nodiscard]] Step stepOf(ObjectId core, unsigned fineness);
    /// What may be as fine as it likes by itself; null: the drawable steps as a whole.
    [[nodiscard]] const ScreenParts* partsOf(ObjectId core) const {
        return drawables_[drawables_.find(core)].parts.get();
    }
    /// Of a drawable that has parts: made when it is first asked for, kept for a few looks. It may not be drawable.
    [[nodiscard]] const RenderMesh* meshOf(ObjectId core, const Fineness& fineness);
    void beginLook() { ++look_; }
    void endLook();

private:
    static constexpr std::uint32_t kNone = IdIndex::kNone;

    struct KeptStep {
        const RenderMesh* mesh = nullptr;
        double deviation = 0;
        bool stale = false;      ///< the core has changed since
        std::uint64_t look = 0;  ///< in which it was asked for last
    };
    struct KeptPattern {
        Fineness fineness;
        const RenderMesh* mesh = nullptr;
        bool stale = false;
        std::uint64_t look = 0;
    };
    struct DrawableUse {
        ObjectId id;
        ObjectId materialId;
        float lineWidth = 0;
        const RenderMesh* mesh = nullptr;
        std::uint32_t material = kNone;
        SlotLink ofMaterial;
        // Where screens may draw it finer:
        std::shared_ptr<const void> keeper;  ///< of the core of `kept`
        Drawable kept;
        double screenError = 0;  ///< 0: they may not
        double slack = 0;
        std::vector<KeptStep>
            steps;  ///< by fineness; of the first the deviation alone, and of those with parts no other
        std::shared_ptr<const ScreenParts> parts;
        std::vector<KeptPattern> patterns;  ///< of those with parts
    };
    struct MaterialUse {
        ObjectId id;
        std::shared_ptr<DrawMaterial> drawn;
        bool transparent = false;
        bool blends = false;  ///< transparent where a vertex colour is
        bool opaque = true;   ///< and its image too
        bool detailed = false, coated = false, glossy = false;
        std::uint16_t state = 0;   ///< which images it has, whether alpha cuts it, its sides
        std::set<ObjectId> parts;  ///< what else it is made of: its program, its passes, theirs
        std::int64_t fill = Material::kFilled;
        float outline = 0;                      ///< pixels: the widest of edges and corners, its own and its passes'
        std::uint8_t outlines = 0, layers = 1;  ///< of those; of all that is drawn with it
        bool edges = false;                     ///< some outline is edges
        bool over = false;                      ///< some pass is blended
        bool coarser = false;
        bool moved = false;     ///< by its program
        double reach = 0;       ///< how far at most
        std::uint64_t cut = 0;  ///< see SceneLook
        std::uint32_t image = kNone;
        std::uint32_t held = 0;  ///< how often
        std::uint32_t firstDrawable = kNone;
        SlotLink ofImage;
    };
    struct ImageUse {
        ObjectId id;
        BlobId pixels;  ///< whose opacity is known, read so
        std::int64_t encoding = 0;
        bool opaque = false;
        std::uint32_t firstMaterial = kNone;
    };

    /// Its fields have changed, or are new.
    void keep(std::uint32_t drawable, const Drawable& now);
    void releaseSteps(DrawableUse& use);
    [[nodiscard]] std::uint32_t knownMaterial(const Aspect& aspect, ObjectId material);
    void forgetUnused(std::uint32_t material);
    [[nodiscard]] SceneLook lookOf(const DrawableUse& use, ObjectId materialId, std::uint32_t material) const;
    void setMaterial(const Aspect& aspect, std::uint32_t drawable, ObjectId material);
    void leaveMaterial(std::uint32_t drawable);
    void setImage(std::uint32_t material, ObjectId image);
    void setParts(std::uint32_t material, std::set<ObjectId> parts);
    void releaseSources(std::span<const DrawMaterial::Level> levels);
    /// Whether it is another now, to those who use it.
    bool refresh(const Aspect& aspect, std::uint32_t material);
    [[nodiscard]] bool imageOpaque(const Aspect& aspect, std::uint32_t image);
    void appendDrawables(std::uint32_t material, std::vector<ObjectId>& to) const;

    MeshCache meshes_;
    SlotTable<DrawableUse> drawables_;
    SlotTable<MaterialUse> materials_;
    SlotTable<ImageUse> images_;
    LookSources sources_;
    std::map<ObjectId, std::set<std::uint32_t>> partUsers_;  ///< materials by their parts
    std::set<ObjectId> stepped_;                             ///< drawables with steps beyond the first, or patterns
    std::uint64_t look_ = 0, cuts_ = 0;
};

}  // namespace tessera
