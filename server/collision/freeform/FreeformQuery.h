/// Smooth bodies against smooth bodies, meshes and hulls: do they touch, where, how far apart are they, when do they
/// first touch?
///
/// No body is tessellated: parts of faces are compared, those that are near are halved, and where two come within the
/// tolerance their nearest points are looked for. What is told of a pair that meets is never "apart"; what is told to
/// touch is no farther apart than the tolerance. Compare Johnson and Cohen 1998 (lower and upper bounds), Snyder 1992
/// and Ma and Hewitt 2003 (subdivision, then Newton); first contacts by conservative advancement (Mirtich 1996; Tang,
/// Kim and Manocha 2009) over pairs of parts.
///
/// A surface is what it is, without an inside; a hull is solid. Maps are any finite affine ones. Spherical fields and
/// lattices take part by the mesh that they are of (`FreeformShape::ofTriangles`). A pair belongs to one thread at a
/// time; its shapes may be read by others meanwhile, and outlive it.
#pragma once

#include <limits>
#include <vector>

#include "server/collision/freeform/FreeformParts.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera {

/// A point of a body.
struct FreeformPlace {
    std::uint32_t face = 0;  ///< as FreeformShape names them
    double u = 0, v = 0;
    Vec3d point = Vec3d::Zero();  ///< in the frame of the query
    Vec3d normal =
        Vec3d::Zero();  ///< of the surface as it is wound, of length 1 in that frame; zero where there is none
};

struct FreeformTouch {
    Touch touch = Touch::kNo;  ///< kUnknown: the work was exhausted, or the map is not finite
    FreeformPlace a, b;   ///< of kYes: no farther apart than the tolerance. Of what is inside a hull both are the point
                          ///< inside, and the hull's face is kNoIndex
    bool inside = false;  ///< touches because it is inside a hull
};

struct FreeformDistanceOptions {
    double tolerance = 1e-9;                                      ///< between `distance` and `least`
    double relative = 0;                                          ///< or this share of the distance
    double upperBound = std::numeric_limits<double>::infinity();  ///< what is farther is of no interest
};
struct FreeformDistance {
    double distance =
        std::numeric_limits<double>::infinity();  ///< between the places; 0 where something is inside a hull
    double least = 0;  ///< proven: nothing is nearer. distance - least is at most the tolerance where it is complete
    FreeformPlace a, b;
    bool farther = false;  ///< nothing is nearer than the upper bound; places say nothing then
    bool complete = true;  ///< false: the work was exhausted, or everything is as near (spheres about one centre)
};

struct FreeformContact {
    FreeformPlace a, b;
    Vec3d point = Vec3d::Zero();   ///< between the places
    Vec3d normal = Vec3d::Zero();  ///< of length 1, from A to B, as both are wound: along the difference of the
                                   ///< normals; A's where these are alike
};
struct FreeformContactOptions {
    double tolerance = 1e-4;
    double spacing = 0;  ///< every place where the bodies meet is within 4 · spacing of a contact; 0: 1/64 of the
                         ///< smaller body's size
    std::size_t most = ~std::size_t{0};  ///< contacts
};
struct FreeformContacts {
    std::vector<FreeformContact> contacts;
    bool complete = true;  ///< false: the work was exhausted, or there are more
};

struct FreeformImpact {
    bool hit = false;
    /// Never after the first contact. At t the places are no farther apart than the tolerance; a motion that comes that
    /// near without touching may be told to hit. Touching at the start is 0. Without a hit 1; not complete: free up to
    /// here.
    double t = 1;
    double distance = 0;
    FreeformPlace a, b;
    Vec3d normal = Vec3d::Zero();  ///< of a hit, from A to B
    bool complete = true;
};

class FreeformPair {
public:
    FreeformPair(const FreeformShape& a, const FreeformShape& b) : a_(a), b_(b), partsA_(a), partsB_(b) {}
    FreeformPair(const FreeformPair&) = delete;
    FreeformPair& operator=(const FreeformPair&) = delete;

    /// In A's frame. A tolerance below what rounding can tell (5e-14 of the coordinates) is taken for that.
    [[nodiscard]] FreeformTouch touch(const Affine3d& a_T_b, double tolerance, QueryWork& work);
    [[nodiscard]] FreeformDistance distance(const Affine3d& a_T_b, QueryWork& work,
                                            const FreeformDistanceOptions& options = {});
    /// Contacts lie on the surfaces: what is inside a hull and meets no face of it has none.
    [[nodiscard]] FreeformContacts contacts(const Affine3d& a_T_b, QueryWork& work,
                                            const FreeformContactOptions& options = {});
    /// In the frame that the motions share.
    [[nodiscard]] FreeformImpact firstContact(const BodyMotion& motionA, const BodyMotion& motionB, double tolerance,
                                              QueryWork& work);

    /// What the last queries have made, and keep for the next.
    [[nodiscard]] std::size_t memoryBytes() const { return partsA_.memoryBytes() + partsB_.memoryBytes(); }

private:
    const FreeformShape &a_, &b_;
    FreeformParts partsA_, partsB_;
};

}  // namespace tessera
