/// What is wrong with programs of materials, said on the wall beside what they are of.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/base/Blob.h"
#include "common/change/ChangeList.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"
#include "server/programs/NoticeText.h"

namespace tessera {

/// Keeps one node, "program-problems", last below the root but for contacts, as long as a SurfaceProgram is bad or heavy, or a material says to its
/// program what that cannot read (common/drawable/ProgramImages.h), and something that is seen has it:
///
///     program-problems   CollisionObject without layers: nobody's obstacle
///       notice           Transform: where, and how large an em is
///         turn           Billboard: towards each user
///           plate        Transform ─ shape: Geometry, a dark sheet behind the letters
///           lines        Transform ─ words: Text
///
/// One for each program and not for each thing that it is of: it stands before the first of these, in the order of the document, about as large for
/// the eye of the first user as letters that are read from afar, whatever the size of the thing. As that eye sees it the first screen shows all of
/// it, none covers another as long as there is room above and below, and all are as near as the nearest, so that what programs are of seldom hides
/// one. Other things may. It goes when the program is good, changed, or of nothing that is seen.
///
/// What reaches the first screen has its notice there: where its middle is seen, else in the screen's middle. Whoever is nearer to a thing than twice its
/// radius has the notice before its box; whoever stands in that, or right before it, has it kBeforeEyeMetres before the eye, straight towards the
/// screen's plane, and farther where screens are for two eyes, which could hardly see it as one. What is still nearer hides it; screens draw
/// nothing of what is nearer than the wall says (Wall::nearMetres), and no notice is. What is wholly beside the first screen, or behind the eye, has its notice before it in the world, for other screens that show it.
/// Notices are placed anew when the eye, or how the wall is turned, has become quite another.
///
/// The lists are edits of the server's own, as verdicts are: no step of undo, in recordings and journals. Nothing is remembered of the nodes: their
/// top says what it is (Node::ofServer). Files leave them out (common/scene/ServerNodes.h).
///
/// Costs nothing while nothing is wrong, but a look at materials with programs when one of their images or uniforms changes. While one is, each frame looks at what is shown; what is shown is found anew at most every kPatience frames,
/// by a walk over kMostVisited nodes. Not thread-safe.
class ProgramNotices {
public:
    static constexpr std::uint64_t kTicket = ~std::uint64_t{6};
    static constexpr std::size_t kMost = 16;  ///< programs, by number; the last notice says how many more there are
    static constexpr std::size_t kMostVisited = 200'000;
    static constexpr unsigned kPatience = 10;
    static constexpr double kBeforeEyeMetres = 0.06, kBeforeTwoEyesMetres = 0.2;

    explicit ProgramNotices(const Wall& wall);

    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);
    /// What is missing, or too much; empty where nothing is. New objects carry placeholders.
    [[nodiscard]] ChangeList notices(const Aspect& scene, const View& view);

    /// The arrays that notices name, but for letters.
    [[nodiscard]] static std::vector<Blob> blobs();
    /// Nodes looked at by the last walk.
    [[nodiscard]] std::size_t visited() const { return visited_; }

    struct WantedNotice;

private:
    /// What a program is of, or a material.
    struct Place {
        ObjectId program, node;
        MeshKey key;  ///< of what `local` is of; nothing of a group
        Box local;
        Box world;
    };
    /// How a notice stands towards the eye: kept while that is good enough, so that a moving head does not make lists without end.
    struct Stand {
        Vec3d towards = Vec3d::UnitZ();  ///< from the middle of what it is of
        double away = 0, em = 0;
        bool close = false;  ///< to the eye, which is in the thing or right before it
    };
    /// As what is laid out was seen.
    struct Sight {
        Affine3d world_T_wall = Affine3d::Identity(), wall_T_world = Affine3d::Identity();
        Vec3d head = Vec3d::Zero();  ///< m, on the wall
        double unitsPerMetre = 1;
        Frustum sees;  ///< on the first screen, in the world
        double nearest = 0;  ///< of what was laid out, m
    };
    void layOut(std::vector<WantedNotice>& wanted, const View& view);
    /// Whether the eye of this view is still about where and what it was.
    [[nodiscard]] bool stillSees(const View& view) const;
    [[nodiscard]] Vec3d headOf(const View& view) const;
    /// How high the first screen is at a distance of 1 from the eye.
    [[nodiscard]] double screenHeightFrom(const Vec3d& head) const;
    void setBad(ObjectId id, bool isBad);
    /// Of `withPrograms_`, those that say to their program what it cannot read.
    void lookAtMaterials(const Aspect& scene);
    /// Of a program or a material, why it has a notice.
    [[nodiscard]] static NoticeText wordsOf(const Aspect& scene, const Place& place);
    void look(const Aspect& scene);
    void follow(const Aspect& scene);
    [[nodiscard]] Stand standOf(const Place& place, const View& view);
    [[nodiscard]] std::vector<ObjectId> tops(const Aspect& scene) const;

    Wall wall_;
    double beforeEye_ = kBeforeEyeMetres;
    std::set<ObjectId> bad_;           ///< programs, and materials
    std::set<ObjectId> withPrograms_;  ///< materials
    std::set<ObjectId> named_;  ///< nodes of the name that is ours
    std::vector<Place> places_;
    std::map<ObjectId, Stand> stands_;  ///< by program or material
    Sight eye_;
    std::size_t laidFor_ = 0;   ///< so many stands
    bool standsMoved_ = false;  ///< since then
    bool lookDue_ = false;
    unsigned sinceLook_ = 0;
    std::size_t visited_ = 0;
};

}  // namespace tessera
