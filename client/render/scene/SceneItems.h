/// What RenderScene keeps: the inside of this folder, not for others.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <set>
#include <unordered_map>
#include <vector>

#include "client/render/scene/BoxTree.h"
#include "client/render/scene/RenderScene.h"
#include "client/render/scene/SceneEffects.h"
#include "client/render/scene/SceneLooks.h"
#include "client/render/scene/ShadowCasters.h"
#include "client/render/scene/ShadowStore.h"
#include "common/cores/Geometry.h"
#include "common/field/NodePose.h"
#include "common/scene/ChildChoice.h"

namespace tessera {

/// A drawable core at its place. What each frame reads of what it shows comes first, by lines of a cache: one that says
/// where it stands in the order, and two for its place.
struct alignas(64) SceneItem {
    ObjectId node, geometry, material;         ///< no node: the slot is free
    const RenderMesh* mesh = nullptr;          ///< as it is drawn on the screen that was looked from last; else `base`
    std::shared_ptr<const DrawMaterial> look;  ///< see SceneLook::drawn
    std::uint32_t scopes = 0;                  ///< see DrawItem
    std::uint16_t state = 0;                   ///< see SceneLook
    MeshKind kind = MeshKind::kTriangles;      ///< see SceneLook
    bool mirrored = false;
    bool transparent = false;
    bool over = false;                         ///< see SceneLook
    bool coarser = false;                      ///< see SceneLook
    bool asWhole = false;                      ///< see SceneLook
    float widestLinePx = DrawItem::kAnyWidth;  ///< on the screen that was looked from last
    /// Where it stands for the user who looks.
    Affine3d world_T_item = Affine3d::Identity();
    float lineWidth = 0;                                    ///< see SceneLook
    std::uint32_t place = 0;                                ///< slot in `places`
    std::int64_t fill = Material::kFilled;                  ///< see SceneLook
    const RenderMesh* base = nullptr;                       ///< as its fields say
    bool turned = false;                                    ///< below a billboard: its place says where it stood else
    bool occludes = false;                                  ///< opaque in every pixel it covers
    bool detailed = false, coated = false, glossy = false;  ///< see SceneLook
    std::uint8_t lineLayers = 0;                            ///< see SceneLook
    bool cornersAlone = false;                              ///< see SceneLook
    Fineness fineness;                                      ///< of `mesh`
    bool byScreen = false;                                  ///< see SceneLook
    double slack = 0;                                       ///< see SceneLook
    std::uint64_t cut = 0;                                  ///< see SceneLook
    bool queued = false;                                    ///< named in `changedItems`
    std::uint8_t seenBy = 0xff;                             ///< users, see ScenePlace
    ObjectId lent;                                          ///< its material, where a group gives it; else none
    double reach = 0;  ///< at least the distance of any vertex from the mesh's own origin, in world units
};

/// What material groups above a place say.
struct GroupMaterials {
    ObjectId nearest;  ///< for what brings none
    ObjectId over;     ///< whatever it brings; none: nobody overrides
    bool operator==(const GroupMaterials&) const = default;
};

/// A node of the scene, attached or not. What children inherit: attached, shown, seenBy, turns, materials, scopes,
/// ofServer, depth, world_T_node.
struct ScenePlace {
    static constexpr std::uint32_t kNone = IdIndex::kNone;
    static constexpr std::uint32_t kAll = 0xfffffffeu;
    static constexpr std::uint32_t kSome = 0xfffffffdu;

    ObjectId id;  ///< of the node
    ObjectId core;
    SceneRole role = SceneRole::kNothing;
    std::uint8_t dirty = 0;                  ///< why it is to be settled
    bool attached = false;                   ///< the root, or below it
    bool shown = false;                      ///< attached, and some user sees it
    bool turns = false, turnsBelow = false;  ///< a billboard stands above it; or is it
    std::uint8_t seenBy = 0;  ///< a bit per user (ChildChoice.h): no switch and no level of detail hides it from them
    bool ordered = false;     ///< stands among `shownLights` or `shownEnvironments`
    bool counted = false;     ///< in `attachedLights`
    std::uint32_t parent = kNone, firstChild = kNone;
    SlotLink sibling;  ///< in no particular order
    SlotLink user;     ///< of the same core
    std::uint32_t shows =
        kAll;  ///< the one child that may be shown, or all, or none, or some: see `some_`; means nothing while hidden
    std::uint32_t item = kNone;      ///< the item here
    std::uint32_t depth = 0;         ///< nodes above
    bool ofServer = false;           ///< while shown: it, or one above, is the server's own (Node::ofServer)
    bool topOfServer = false;        ///< its node says so itself
    std::uint32_t orderedBelow = 0;  ///< ordered places at and below it
    std::uint32_t newDepth = 0, newDepthIn = 0;    ///< while an update runs, see depthNow
    GroupMaterials materials;                      ///< for what is below, while shown
    std::uint32_t scopes = 0;                      ///< while shown: see DrawItem
    Affine3d world_T_node = Affine3d::Identity();  ///< while shown; nothing turned
};

/// How far items reach, by octaves: the greatest of a set that changes.
class ReachCounts {
public:
    void add(double reach) { ++counts_[octave(reach)]; }
    void remove(double reach) { --counts_[octave(reach)]; }
    /// Not below any, and less than twice the greatest (but for the smallest octave); 0 where none reaches anywhere.
    [[nodiscard]] double bound() const;

private:
    static constexpr int kLowest = -60;
    static constexpr std::size_t kOctaves = 192;  ///< the first one is for zero
    [[nodiscard]] static std::size_t octave(double reach);
    std::array<std::uint32_t, kOctaves> counts_{};
};

struct RenderScene::Impl {
    static constexpr std::size_t kWidestReachPx = static_cast<std::size_t>(0.7072 * Geometry::kWidestLinePx) + 1;

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    // What actions read.
    SlotTable<ScenePlace> places;
    std::vector<SceneItem> items;  ///< in slots; the box of a free one is empty
    std::vector<Box> boxes;        ///< of the items, world; empty where an item is beyond all measure
    BoxTree tree;
    ReachCounts reaches;
    std::vector<LightItem> lights;
    std::uint64_t lightsLeftOut = 0;  ///< shown, and beyond DrawList::kMaxLights
    Environment environment;
    std::optional<Studio> studio;  ///< where the view has one, and the scene neither light nor surroundings
    std::uint64_t shadowsLeftOut = 0;
    std::uint64_t scopesLeftOut = 0;                      ///< see DrawList
    std::array<ObjectId, DrawList::kMaxScopes> scopes{};  ///< by bit; no node: the bit is free
    /// For the tiles of a screen; null where no light has shadows, or the screen shows none. The one before, as long as
    /// nothing of it is another.
    [[nodiscard]] std::shared_ptr<const ShadowCasters> shadowCasters(const ScreenCamera& screen) const;
    mutable ShadowStore shadows;
    /// Writes a fresh DrawItem: all but its box and its clusters.
    void describe(std::uint32_t item, DrawItem& drawn) const;
    /// Soon: so that it lies in a cache then.
    void askFor(std::uint32_t item) const;
    std::size_t detailedItems = 0, coatedItems = 0, glossyItems = 0;
    std::uint64_t transparentTriangles = 0;       ///< of what the fields say
    std::uint64_t finerTransparentTriangles = 0;  ///< more, on the screen that was looked from last
    std::uint64_t transparentChanges = 0;         ///< grows whenever a transparent item comes, goes or moves
    /// Items by the reach of their lines, see `lineReachPx`.
    std::array<std::size_t, kWidestReachPx + 1> linesByReach{};
    /// Nodes of what is shown and left out: beyond kUtmostCoordinate, or of a mesh that is not whole.
    std::set<ObjectId> undrawn;
    /// Items that screens may draw finer.
    std::set<std::uint32_t> byScreen;
    /// Items with lines of more than a pixel.
    std::set<std::uint32_t> wideLines;
    NarrowedLines narrowed;  ///< on the screen that was looked from last
    /// Of all items, in pixels; 0 without lines.
    [[nodiscard]] double widestLineReachPx() const;
    std::uint64_t rebuilds = 0;
    SceneVersion version;

    /// In its own coordinates: around it, however fine it is drawn.
    [[nodiscard]] static Box reachedBy(const SceneItem& item);
    /// From here on everything is as this screen shows it: items are those that its user sees, billboards look at the
    /// user's head (UserView.cpp), meshes are as fine as the screen wants (ScreenFineness.h), lines as wide as it can
    /// bear (LineWidths.h). Before anything that is done for one of its tiles.
    void lookFrom(const ScreenCamera& camera);

    void rebuild(const Aspect& aspect);
    void follow(const Aspect& aspect, const ChangeList& list);
    /// Places, links, tree nodes and casters that changes have looked at so far: what tests of cost count.
    [[nodiscard]] std::uint64_t work() const { return work_ + tree.work() + shadows.work(); }

private:
    static constexpr std::uint32_t kNone = ScenePlace::kNone;
    enum Dirty : std::uint8_t { kCore = 1, kChoice = 2, kPose = 4, kDrawn = 8, kPlaced = 16, kScoped = 32 };

    // RenderScene.cpp: from a list to the places that it concerns.
    void followField(Effect effects, std::span<const ObjectId> ids);
    std::uint32_t addPlace(ObjectId node, std::uint32_t parent);
    void removePlace(std::uint32_t place);
    void adopt(ObjectId top);
    void takeOut(ObjectId node);
    void putUnderParent(ObjectId node);
    void setCore(std::uint32_t place, ObjectId core);
    void mark(std::uint32_t place, Dirty why);
    void markUsers(ObjectId core, Dirty why);
    /// What has been queued: the tree, and what follows shadows.
    void followBoxes();
    void finish();
    void refreshLights();
    void setScopes(std::span<const ObjectId> now);
    [[nodiscard]] std::uint32_t scopeBit(ObjectId node) const;
    [[nodiscard]] LightItem lightAt(std::uint32_t place, const LightSource& source) const;

    // UserView.cpp
    void showTo(const ScreenCamera& camera);
    void turnBillboards();
    void turnBelow(std::uint32_t billboard);
    void chooseLights();

    // ScreenFineness.cpp
    void refineFor(const ScreenCamera& camera);
    void drawAt(std::uint32_t item, const Fineness& fineness, const RenderMesh* mesh);

    // LineWidths.cpp
    void narrowFor(const ScreenCamera& camera);

    // ShadowCasters.cpp
    [[nodiscard]] Box boundsWithin(const Box& part) const;

    // ScenePlaces.cpp: what is to be known of a place, from its parent down.
    void settleAll(bool treeChanged);
    void settle(std::uint32_t top);
    void settleItem(std::uint32_t place, bool moved, bool another);
    void enterBelow(std::uint32_t place, bool reorder);
    void enterChild(std::uint32_t place, std::uint32_t child, bool reorder);
    /// The child that all see, or none, all or kSome; then `some_` has who sees which.
    [[nodiscard]] std::uint32_t shownChild(std::uint32_t place);
    /// Of those who see a place, who may see this child of it.
    [[nodiscard]] std::uint8_t mayBeSeenBy(std::uint32_t place, std::uint32_t child) const;
    [[nodiscard]] GroupMaterials materialsBelow(const ScenePlace& place) const;
    void keepTurn(std::uint32_t place);
    void lend(SceneItem& item, ObjectId material);
    [[nodiscard]] Affine3d worldOf(const ScenePlace& place) const;
    [[nodiscard]] std::uint32_t depthNow(std::uint32_t place);
    void leaveRole(std::uint32_t place);
    void placeItem(std::uint32_t item);
    void countLooks(std::uint32_t item, int sign);
    void freeItem(ScenePlace& place);
    void queue(std::uint32_t item);

    // What stands in document order.
    [[nodiscard]] bool before(std::uint32_t a, std::uint32_t b) const;
    void takeOut(std::uint32_t place);
    void putIn(std::uint32_t place);
    void countOrdered(std::uint32_t place, std::int64_t more);

    struct InDocumentOrder {
        const Impl* scene;
        bool operator()(std::uint32_t a, std::uint32_t b) const { return scene->before(a, b); }
    };
    using OrderedPlaces = std::set<std::uint32_t, InDocumentOrder>;
    struct Open {
        std::uint32_t place;
        bool reorder;  ///< it, or what it lies in, has been placed anew
    };

    const Aspect* aspect_ = nullptr;  ///< while an update runs
    IdIndex users_;                   ///< core → the first place that has it
    SceneLooks looks_;
    std::vector<std::uint32_t> freeItems_;
    OrderedPlaces shownLights_{InDocumentOrder{this}}, shownEnvironments_{InDocumentOrder{this}};
    std::unordered_map<std::uint32_t, OrderedPlaces::iterator> standing_;
    std::size_t attachedLights_ = 0;  ///< hidden ones counted
    bool lightsStale_ = false;
    bool beacons_ = false;  ///< some light that is shown stands at another node
    /// What some user sees, and who.
    struct SeenLight {
        LightItem light;
        std::uint8_t seenBy;
        ObjectId scope;
    };
    std::vector<SeenLight> seenLights_;
    std::vector<std::pair<Environment, std::uint8_t>>
        seenEnvironments_;  ///< the first, and those behind it while not all see them
    bool lightsByUser_ = false;

    // Who looks, see UserView.cpp.
    using SeenChildren = std::map<std::uint32_t, std::uint8_t>;  ///< child → a bit for each user who sees it
    std::unordered_map<std::uint32_t, SeenChildren> some_;       ///< of places that show kSome
    std::set<std::uint32_t> byUser_;                             ///< items that not all see
    struct Turn {
        NodePose pose;
        Vec3d axis;  ///< of a billboard
    };
    std::unordered_map<std::uint32_t, Turn>
        turns_;                           ///< places that are shown: billboards, and what moves things below one
    std::set<std::uint32_t> billboards_;  ///< shown, and below no other
    bool turnsStale_ = false;
    std::uint8_t userBit_ = 1;
    std::optional<Studio> studioOfView_;
    Vec3d head_ = Vec3d::Zero();
    std::unordered_map<ObjectId, std::set<std::uint32_t>>
        lentTo_;  ///< materials of groups → places of the items that have them
    std::vector<std::pair<std::uint32_t, Affine3d>> turning_;
    mutable std::shared_ptr<const ShadowCasters> casters_;
    SceneVersion lookedAt_;  ///< by lookFrom
    ScreenCamera lookedFrom_{};
    SceneVersion narrowedAt_;  ///< by narrowFor
    ScreenCamera narrowedFrom_{};

    // Of the update that runs.
    std::vector<std::uint32_t> dirty_;
    std::vector<std::uint64_t> byDepth_;
    std::vector<std::uint32_t> arrivals_;  ///< to stand in document order
    std::vector<std::uint32_t> changedItems_;
    std::vector<ObjectId> changedLooks_;
    std::vector<Open> open_;
    std::vector<std::uint32_t> path_;
    std::uint32_t update_ = 0;
    mutable std::uint64_t work_ = 0;
};

/// Appends the items whose box is not wholly outside, of these planes.
void collectInFrustum(const RenderScene::Impl& scene, const Frustum& frustum, std::vector<std::uint32_t>& found,
                      Frustum::Mask planes = Frustum::kAllPlanes);

/// How a billboard at a node turns, in the node's own coordinates: to bring +Z towards a head, about an axis as far as
/// that allows. Not at all where that means nothing: a head on the axis or at the origin, +Z along the axis,
/// coordinates that are not finite or have no inverse. IEEE's four operations and roots alone, as ScreenMeasure.
[[nodiscard]] Mat3d turnTowards(const Vec3d& headWorld, const Vec3d& axis, const Affine3d& world_T_node);

}  // namespace tessera
