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

struct WantedNotice;

/// Shows on the wall why a material is drawn without its program. All notices stand below one node, "program-problems".
/// It is the last below the root; only contacts come behind it. It is there as long as both hold:
/// - A SurfaceProgram is bad or heavy, or a material gives its program an image that it cannot read
///   (common/drawable/ProgramImages.h).
/// - Something that is seen has that program or material.
///
///     program-problems   CollisionObject without layers: nobody's obstacle
///       notice           Transform: where, and how large an em is
///         turn           Billboard: towards each user
///           plate        Transform ─ shape: Geometry, a dark sheet behind the letters
///           lines        Transform ─ words: Text
///
/// **Number.** There is one notice for each program, not one for each thing that has it. It stands before the first of
/// these things, in the order of the document. It goes when the program is good or changed, or when no seen thing has
/// it.
///
/// **Size.** For the first user's eye a notice is about as large as letters that are read from afar. The size of its
/// thing does not matter. As that eye sees it, the first screen shows all of the notice.
///
/// **Overlap.** No notice covers another as long as there is room above and below. All are as near as the nearest, so
/// that things with programs seldom hide one. Other things may hide one.
///
/// **Place.** A thing that reaches the first screen has its notice there, where the thing's middle is seen. Where that
/// is not seen, the notice is in the screen's middle.
/// - An eye nearer to a thing than twice its radius has the notice before the thing's box.
/// - An eye in that box, or right before it, has the notice straight towards the screen's plane. It is kBeforeEyeMetres
///   before the eye. It is farther where screens are for two eyes, which could hardly see it as one.
/// - Still nearer things hide the notice. Screens draw nothing nearer than Wall::nearMetres, so no notice is nearer.
/// - A thing wholly beside the first screen, or behind the eye, has its notice before it in the world. Other screens
///   may show it.
///
/// Notices are placed anew when the eye, or the turn of the wall, has changed much.
///
/// **Lists.** They are edits of the server's own, as verdicts are. They are no steps of undo, and stand in recordings
/// and journals. Nothing is remembered of the nodes: their top says what it is (Node::ofServer). Files leave them out
/// (common/scene/ServerNodes.h).
///
/// **Cost.** While nothing is wrong, the only cost is a look at materials with programs when one of their images or
/// uniforms changes. While something is wrong, each frame looks at the shown things. These are found anew at most every
/// kPatience frames, by a walk over kMostVisited nodes. Not thread-safe.
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

private:
    /// What a program is of, or a material.
    struct Place {
        ObjectId program, node;
        MeshKey key;  ///< of what `local` is of; nothing of a group
        Box local;
        Box world;
    };
    /// How a notice stands towards the eye. It is kept while that is good enough, so that a moving head does not make
    /// lists without end.
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
        Frustum sees;        ///< on the first screen, in the world
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
    std::set<ObjectId> named_;         ///< nodes of the name that is ours
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
