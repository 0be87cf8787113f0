/// Requests about the wall itself, and what an application is told from now on. For Deeds.cpp alone.
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

inline ServerActions subscribe(Desk& desk, const Asker& asker, const request::SubscribeNews& wish, TimePoint) {
    ServerActions actions = desk.news.subscribe(asker.connection, wish.wanted);
    append(actions, desk.done(asker));
    return actions;
}

inline ServerActions whoAmI(Desk& desk, const Asker& asker, const request::WhoAmI&, TimePoint) {
    const auto known = desk.applications.find(asker.connection);
    answer::Identity who;
    if (known != desk.applications.end()) who = {.name = known->second.name, .role = known->second.who.role};
    return desk.answer(asker, ApplicationAnswer(std::move(who)));
}

inline ServerActions getPeople(Desk& desk, const Asker& asker, const request::GetPeople&, TimePoint now) {
    const std::size_t most = ApplicationLimits().maxPeople;
    answer::People people;
    for (const auto& [connection, known] : desk.applications) {
        if (people.people.size() == most) break;
        people.people.push_back({.name = known.who.name,
                                 .program = known.name,
                                 .role = known.who.role,
                                 .seconds = toMilliseconds(now - known.since) / 1000,
                                 .you = connection == asker.connection});
    }
    people.leftOut = desk.applications.size() - people.people.size();
    return desk.answer(asker, ApplicationAnswer(std::move(people)));
}

inline constexpr DeedTable kRows{&getStatus, &getTrackers, &subscribe, &whoAmI, &getPeople};

}  // namespace tessera::status_deeds
