/// What somebody wants of the navigator in one frame, whatever it is said with: windows, a terminal, a wand.
#pragma once

#include <optional>
#include <vector>

#include "common/input/InputState.h"
#include "common/math/Ray.h"
#include "common/math/Types.h"

namespace tessera {

/// Several sources add up (`add`). Values beyond their bounds count as the bounds.
struct NavigationInput {
    // Held now, -1 to 1 each.
    Vec3d move = Vec3d::Zero();  ///< right, up, back
    Vec2d turn = Vec2d::Zero();  ///< to the right, upwards
    double roll = 0;             ///< to the right
    bool faster = false;

    // Done since the frame before.
    Vec2d look = Vec2d::Zero();        ///< a drag that turns: to the right, down; heights of a window
    Vec2d pan = Vec2d::Zero();         ///< a drag that shifts, likewise: as tangents of angles at the eye
    double wheel = 0;                  ///< clicks, away from the person
    std::vector<InputAction> actions;  ///< asked for once

    /// Where the newest grab or fit points: the wall's frame, metres.
    std::optional<Ray> pointing;

    /// Wants the view to move, apart from `actions`.
    [[nodiscard]] bool steers() const {
        return !move.isZero(0) || !turn.isZero(0) || roll != 0 || !look.isZero(0) || !pan.isZero(0) || wheel != 0;
    }
    void add(const NavigationInput& other) {
        move += other.move;
        turn += other.turn;
        roll += other.roll;
        faster = faster || other.faster;
        look += other.look;
        pan += other.pan;
        wheel += other.wheel;
        actions.insert(actions.end(), other.actions.begin(), other.actions.end());
        if (other.pointing) pointing = other.pointing;
    }
};

}  // namespace tessera
