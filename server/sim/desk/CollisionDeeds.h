/// Requests about collisions, and answers to questions. For Deeds.cpp alone.
#pragma once

#include "server/sim/desk/DeedTable.h"

namespace tessera::collision_deeds {

inline ServerActions getContacts(Desk& desk, const Asker& asker, const request::GetContacts&, TimePoint) {
    return desk.answer(asker, ApplicationAnswer(desk.news.contacts()));
}

inline ServerActions getEvents(Desk& desk, const Asker& asker, const request::GetEvents&, TimePoint) {
    return desk.answer(asker, ApplicationAnswer(desk.news.events()));
}

inline ServerActions getDistances(Desk& desk, const Asker& asker, const request::GetDistances&, TimePoint) {
    return desk.answer(asker, ApplicationAnswer(desk.news.distances()));
}

inline ServerActions getQuestions(Desk& desk, const Asker& asker, const request::GetQuestions&, TimePoint) {
    return desk.answer(asker, ApplicationAnswer(desk.news.questions()));
}

inline ServerActions answerQuestion(Desk& desk, const Asker& asker, const request::AnswerQuestion& wish, TimePoint) {
    const Expected<void> taken = desk.news.decide(wish.reply);
    return taken ? desk.done(asker) : desk.refuse(asker, taken.error());
}

inline constexpr DeedTable kRows{&getContacts, &getEvents, &getDistances, &getQuestions, &answerQuestion};

}  // namespace tessera::collision_deeds
