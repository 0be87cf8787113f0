/// Requests about the wall itself. For Deeds.cpp alone.
#pragma once

#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/StatusAnswers.h"

namespace tessera::status_deeds {

inline ServerActions getStatus(Desk& desk, const Asker& asker, const request::GetStatus&, TimePoint) {
    answer::Status status = statusOf(desk.around);
    status.applications = desk.applications.size();
    return desk.answer(asker, ApplicationAnswer(std::move(status)));
}

inline ServerActions getTrackers(Desk& desk, const Asker& asker, const request::GetTrackers&, TimePoint) {
    return desk.answer(asker, ApplicationAnswer(trackersOf(desk.around)));
}

inline constexpr DeedTable kRows{&getStatus, &getTrackers};

}  // namespace tessera::status_deeds
