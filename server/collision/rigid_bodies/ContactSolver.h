/// Moves the bodies of an island through a frame so that they keep apart.
///
/// Sequential impulses (E. Catto, "Iterative Dynamics with Temporal Coherence", 2005) in small steps: the frame is cut
/// into sub-steps, each with one pass that also lifts bodies out of each other softly and one without, so that the
/// lifting leaves no speed behind (M. Macklin et al., "Small Steps in Physics Simulation", 2019; E. Catto, "Solver2D",
/// 2024). Between sub-steps gaps follow the bodies' motion; which points there are stays for the frame.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/Types.h"

namespace tessera::rigid {

/// While it is solved, the spin is that of a body as it stands when the frame begins: inertia times it is the angular
/// momentum, whatever way it has turned meanwhile. At the end it is that of where it then is.
struct SolverBody {
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
    double inverseMass = 0;       ///< 0: goes as its velocity says
    Vec3d moved = Vec3d::Zero();  ///< of the centre, so far in the frame
    Mat3d turn = Mat3d::Zero();   ///< rotation less identity; up to here passes read it
    Quatd turned = Quatd::Identity();
    Mat3d inverseInertia = Mat3d::Zero();  ///< world, as the frame begins
    Mat3d inertia = Mat3d::Zero();         ///< its inverse
};

struct SolverPoint {
    std::uint32_t bodyA = 0, bodyB = 0;
    Vec3d normal, tangent[2];
    Vec3d armA, armB;  ///< from the centres, as the frame begins
    double gap = 0;    ///< to where they are meant to rest
    double friction = 0, restitution = 0;
    double push = 0;                          ///< most speed at which overlap is undone
    double impulse = 0, rubbing[2] = {0, 0};  ///< of a sub-step; in: to start from
    double most = 0;                          ///< largest impulse in the frame
    double approach = 0;                      ///< speed along the normal before they met: below 0
    bool hard = false;                        ///< one of them does not give way: overlap is undone faster
    // Made by the solver.
    Vec3d angularA, angularB, tangentA[2], tangentB[2];  ///< inverse inertia times arm × direction
    double mass = 0, tangentMass[2] = {0, 0};
};

struct SolverStep {
    Vec3d gravity = Vec3d::Zero();
    double seconds = 0;
    int substeps = 6;
    double bounceSpeed = 0;  ///< slower approaches do not bounce
};

/// `bodies`: of this island, indices into `all`. Bodies that do not give way are shared by islands and are only read:
/// their places at the end of each sub-step follow from their velocities.
void solveIsland(std::span<SolverBody> all, std::span<const std::uint32_t> bodies, std::span<SolverPoint> points,
                 const SolverStep& step);

/// And two tangents, made from it alone.
void setNormal(SolverPoint& point, const Vec3d& normal);

/// Turns freely for a while: implicit midpoint rule in the body's frame, rotation by Cayley's map. The angular momentum
/// in the world stays by construction, and so does the energy, whatever the step (M. Austin, P. S. Krishnaprasad, L.-S.
/// Wang, "Almost Poisson Integration of Rigid Body Systems", 1993; D. Lewis, J. C. Simo, "Conserving Algorithms for the
/// Dynamics of Hamiltonian Systems on Lie Groups", 1994).
void turnBody(SolverBody& body, double seconds);

}  // namespace tessera::rigid
