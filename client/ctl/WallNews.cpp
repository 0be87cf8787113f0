#include "client/ctl/WallNews.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/wall/Detail.h"

namespace tessera {

bool WallNews::states(const notice::States& now) {
    if (states_) {
        for (const answer::HostInfo& host : now.hosts) {
            const auto then = std::ranges::find(states_->hosts, host.name, &answer::HostInfo::name);
            const std::string before = then == states_->hosts.end() ? "unknown" : then->state;
            if (before == host.state) continue;
            happened("host", fmt::format("{} is {} (was {})", host.name, host.state, before),
                     {{"host", host.name}, {"state", host.state}, {"was", before}});
        }
        if (states_->journalTrouble != now.journalTrouble)
            happened("journal",
                     now.journalTrouble.empty() ? std::string("is written again")
                                                : fmt::format("no edit is taken: {}", now.journalTrouble),
                     {{"trouble", now.journalTrouble}});
    }
    const bool moved = !states_ || states_->comings != now.comings;
    states_ = now;
    return moved;
}

void WallNews::people(const answer::People& now) {
    std::multiset<Known> there;
    for (const answer::Person& person : now.people)
        if (!person.you) there.insert({person.name, person.program, std::string(nameOf(person.role))});
    const auto told = [&](const std::multiset<Known>& who, const std::multiset<Known>& others, const char* what) {
        std::vector<Known> only;
        std::ranges::set_difference(who, others, std::back_inserter(only));
        for (const Known& one : only)
            happened(
                "person",
                fmt::format("{} {} ({}, {})", one.name.empty() ? "somebody" : one.name, what, one.program, one.role),
                {{"name", one.name}, {"program", one.program}, {"role", one.role}, {"what", what}});
    };
    if (people_) {
        told(*people_, there, "went");
        told(there, *people_, "came");
    }
    people_ = std::move(there);
}

void WallNews::frame(const notice::Frame& now) {
    const std::set<std::string> holding(now.held.begin(), now.held.end());
    for (const std::string& host : holding)
        if (!holding_.contains(host))
            happened("frame", fmt::format("{} goes on showing an earlier one than {}", host, now.frame.value),
                     {{"host", host}, {"frame", now.frame.value}, {"held", true}});
    for (const std::string& host : holding_)
        if (!holding.contains(host) && std::ranges::find(now.shown, host) != now.shown.end())
            happened("frame", fmt::format("{} shows the newest again, {}", host, now.frame.value),
                     {{"host", host}, {"frame", now.frame.value}, {"held", false}});
    holding_ = holding;
}

void WallNews::lines(const char* kind, std::vector<std::string>& known, const std::vector<std::string>& now) {
    for (const std::string& line : now)
        if (std::ranges::find(known, line) == known.end()) happened(kind, line, {{"line", line}});
    known = now;
}

bool WallNews::status(const answer::Status& now) {
    const bool edited = !status_ || status_->sequence != now.sequence;
    if (status_) {
        if (status_->detail != now.detail)
            happened("detail",
                     fmt::format("step {} of {} of detail is left away (was {})", now.detail, kDetailSteps.size() - 1,
                                 status_->detail),
                     {{"step", now.detail}, {"was", status_->detail}});
        lines("program", status_->programs, now.programs);
    }
    status_ = now;
    return edited;
}

void WallNews::steps(const answer::Steps& now) {
    // What plays, and verdicts of the server's own, are no steps. Of two alike the depth tells that there is one more.
    const std::uint64_t depth = status_ ? status_->undoDepth : 0;
    if (steps_ && (steps_->undo != now.undo || depth != depth_)) {
        const bool back = depth < depth_ && !now.redo.what.empty();
        const std::string& what = back ? now.redo.what : now.undo.what;
        if (!what.empty()) {
            nlohmann::ordered_json objects = nlohmann::ordered_json::array();
            for (const ObjectId id : (back ? now.redo : now.undo).objects) objects.push_back(id.value);
            happened("edit", fmt::format("{}{} (change {})", back ? "taken back: " : "", what, now.sequence.value),
                     {{"what", what},
                      {"taken_back", back},
                      {"sequence", now.sequence.value},
                      {"objects", std::move(objects)}});
        }
    }
    steps_ = now;
    depth_ = depth;
}

}  // namespace tessera
