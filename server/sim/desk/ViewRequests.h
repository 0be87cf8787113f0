/// Those who say where the wall stands. To go back to where all of it is seen takes a look at the scene that no frame
/// waits for.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "server/sim/desk/Answering.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {

class Simulation;

/// Wishes count in the order in which they came: where one waits for a survey of the scene as it was when it was asked,
/// later ones wait behind it, and the wall stands where it stood. One survey serves all who asked before it. Frame
/// thread only.
class ViewRequests {
public:
    /// Orders how far the scene as it is now reaches (AnimatedBounds), found elsewhere; `surveyed` is told. One at a
    /// time. Empty: it is found between two frames.
    using Survey = std::function<void()>;
    ViewRequests(const Answers& answers, ViewSource& view, const Simulation& simulation, Survey survey)
        : answers_(answers), view_(view), simulation_(simulation), survey_(std::move(survey)) {}

    [[nodiscard]] ServerActions ask(const Asker& asker, const ViewWish& wish);
    /// `at`: the list up to which the scene had come.
    [[nodiscard]] ServerActions surveyed(const AnimatedBounds& bounds, Sequence at);
    /// What it waits for does not happen.
    void applicationLeft(ConnectionId connection);
    /// Of one application.
    [[nodiscard]] std::size_t openCount(ConnectionId connection) const;

private:
    struct Waiting {
        Asker asker;
        ViewWish wish;
        Sequence asked;
    };
    [[nodiscard]] bool needsSurvey(const ViewWish& wish) const {
        return survey_ && wish.reset && !view_.hasCamera() && view_.framesScene();
    }
    [[nodiscard]] ServerActions set(const Asker& asker, const ViewWish& wish, const AnimatedBounds* bounds);
    /// As far as what is known goes.
    [[nodiscard]] ServerActions goOn();

    const Answers answers_;
    ViewSource& view_;
    const Simulation& simulation_;
    Survey survey_;
    bool ordered_ = false;
    std::deque<Waiting> waiting_;
    std::optional<std::pair<Sequence, AnimatedBounds>> known_;  ///< of the last survey
};

}  // namespace tessera
