#include "client/ctl/CollisionVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "client/ctl/FieldText.h"
#include "client/ctl/SceneNames.h"
#include "client/ctl/TextTable.h"
#include "common/cores/Interest.h"

namespace tessera {

namespace {

using Json = nlohmann::ordered_json;
using namespace std::chrono_literals;

std::string_view nameOf(TouchPhase phase) {
    switch (phase) {
        case TouchPhase::kBegan:
            return "began";
        case TouchPhase::kStays:
            return "stays";
        case TouchPhase::kEnded:
            break;
    }
    return "ended";
}

std::string faceText(std::uint32_t face) {
    return face == ContactValue::kNoFace ? "hull" : fmt::format("{}", face);
}
std::string depthText(double depth) {
    return depth < 0 ? "-" : fmt::format("{:.4g}", depth);
}
/// Of a smooth surface its own face and parameters, for people as for programs.
std::string placeText(std::uint32_t face, std::uint32_t patch, const Vec2d& uv) {
    return patch == ContactValue::kNoFace ? faceText(face) : fmt::format("{} at {:.4g} {:.4g}", patch, uv.x(), uv.y());
}
Json patchJson(std::uint32_t patch, const Vec2d& uv) {
    if (patch == ContactValue::kNoFace) return nullptr;
    return {{"face", patch}, {"uv", {uv.x(), uv.y()}}};
}
Json placeJson(const Vec2d& uv) {
    return Json::array({uv.x(), uv.y()});
}
Json faceJson(std::uint32_t face) {
    return face == ContactValue::kNoFace ? Json(nullptr) : Json(face);
}

/// The Interest core at a node.
Expected<ObjectId> interestAt(Application& application, const std::string& name) {
    const Expected<ObjectInfo> node = application.describeNode(name);
    if (!node) return tl::unexpected(node.error());
    if (!node->core || node->coreType != typeOf<Interest>())
        return fail(ErrorCode::kNotFound, fmt::format("{} is no Interest; see tree for those there are", name));
    return node->core;
}

// ---- one kind of list each: rows for people, entries for programs

struct Listing {
    TextTable table;
    Json entries = Json::array();
    std::size_t rows = 0, more = 0;
};

std::vector<ObjectId> namedIn(const ContactValue& c) {
    return {c.objectA, c.objectB};
}
std::vector<ObjectId> namedIn(const PairEventValue& e) {
    return {e.objectA, e.objectB};
}
std::vector<ObjectId> namedIn(const PairDistanceValue& d) {
    return {d.objectA, d.objectB, d.nodeA, d.nodeB};
}

/// Takes those that `wanted` names, up to its limit.
template <typename Value, typename Add>
void list(Listing& listing, const std::vector<Value>& values, SceneNames& names, const verb::Contacts& wanted,
          ObjectId interest, Add add) {
    std::vector<const Value*> rows;
    std::vector<ObjectId> nodes, interests;
    for (const Value& value : values) {
        if (interest && value.interest != interest) continue;
        if (wanted.limit >= 0 && rows.size() >= static_cast<std::size_t>(wanted.limit)) {
            ++listing.more;
            continue;
        }
        rows.push_back(&value);
        std::ranges::copy(namedIn(value), std::back_inserter(nodes));
        interests.push_back(value.interest);
    }
    names.learn(nodes);
    names.learnInterests(interests);
    listing.rows = rows.size();
    for (const Value* value : rows) add(*value);
}

Listing listed(const answer::Contacts& told, SceneNames& names, const verb::Contacts& wanted, ObjectId interest) {
    Listing out{.table = TextTable({"objects", "faces", "point", "normal", "depth", "time", "interest"})};
    list(out, told.contacts, names, wanted, interest, [&](const ContactValue& c) {
        out.table.add({names.pair(c.objectA, c.objectB),
                       placeText(c.faceA, c.patchA, c.patchUvA) + " - " + placeText(c.faceB, c.patchB, c.patchUvB),
                       textOf(c.point), textOf(c.normal), depthText(c.depth), fmt::format("{:.4g}", c.time),
                       names.interest(c.interest)});
        out.entries.push_back(
            {{"objects", names.pairJson(c.objectA, c.objectB)},
             {"faces", Json::array({faceJson(c.faceA), faceJson(c.faceB)})},
             {"point", jsonOf(c.point)},
             {"places", Json::array({placeJson(c.uvA), placeJson(c.uvB)})},
             {"patches", Json::array({patchJson(c.patchA, c.patchUvA), patchJson(c.patchB, c.patchUvB)})},
             {"normal", jsonOf(c.normal)},
             {"depth", c.depth < 0 ? Json(nullptr) : Json(c.depth)},
             {"error", c.error},
             {"interest", names.interestJson(c.interest)},
             {"time", c.time}});
    });
    return out;
}

Listing listed(const answer::PairEvents& told, SceneNames& names, const verb::Contacts& wanted, ObjectId interest) {
    Listing out{.table = TextTable({"event", "objects", "time", "point", "normal", "interest"})};
    list(out, told.events, names, wanted, interest, [&](const PairEventValue& e) {
        const bool where = !e.normal.isZero();
        out.table.add({e.through ? "through" : std::string(nameOf(e.phase)), names.pair(e.objectA, e.objectB),
                       fmt::format("{:.4g}", e.firstTime), where ? textOf(e.point) : "-",
                       where ? textOf(e.normal) : "-", names.interest(e.interest)});
        out.entries.push_back({{"phase", nameOf(e.phase)},
                               {"through", e.through},
                               {"objects", names.pairJson(e.objectA, e.objectB)},
                               {"first_time", e.firstTime},
                               {"point", where ? jsonOf(e.point) : Json(nullptr)},
                               {"normal", where ? jsonOf(e.normal) : Json(nullptr)},
                               {"interest", names.interestJson(e.interest)}});
    });
    return out;
}

Listing listed(const answer::Distances& told, SceneNames& names, const verb::Contacts& wanted, ObjectId interest) {
    Listing out{.table = TextTable({"near", "objects", "distance", "nearest points", "interest"})};
    list(out, told.distances, names, wanted, interest, [&](const PairDistanceValue& d) {
        out.table.add({std::string(nameOf(d.phase)), names.pair(d.objectA, d.objectB),
                       fmt::format("{:.6g}", d.distance) + (d.error > 0 ? fmt::format(" +- {:.2g}", d.error) : ""),
                       textOf(d.pointA) + " - " + textOf(d.pointB), names.interest(d.interest)});
        out.entries.push_back({{"phase", nameOf(d.phase)},
                               {"objects", names.pairJson(d.objectA, d.objectB)},
                               {"distance", d.distance},
                               {"error", d.error},
                               {"nodes", names.pairJson(d.nodeA, d.nodeB)},
                               {"faces", Json::array({faceJson(d.faceA), faceJson(d.faceB)})},
                               {"points", Json::array({jsonOf(d.pointA), jsonOf(d.pointB)})},
                               {"interest", names.interestJson(d.interest)}});
    });
    return out;
}

// Of interests one may be named; elsewhere all are meant.
Expected<ObjectId> wantedInterest(Application& application, const verb::Contacts& wanted) {
    if (wanted.interest.empty()) return ObjectId{};
    return interestAt(application, wanted.interest);
}

std::string notListed(std::uint64_t more, std::string_view why) {
    return more == 0 ? "" : fmt::format(", {} more {}", more, why);
}

Expected<Answer> showContacts(Application& application, const verb::Contacts& wanted, ObjectId interest) {
    const Expected<answer::Contacts> told = application.contacts();
    if (!told) return tl::unexpected(told.error());
    SceneNames names(application);
    const Listing out = listed(*told, names, wanted, interest);
    return Answer{
        out.table.text() +
            fmt::format("{} contacts in frame {}, {} begun so far{}{}{}\n", out.rows + out.more, told->frame.value,
                        told->begun, notListed(told->leftOut, "found than are listed"),
                        notListed(out.more, "than --limit"),
                        told->notLookedAt == 0 ? "" : fmt::format("; {} pairs not looked at", told->notLookedAt)),
        {{"frame", told->frame.value},
         {"begun", told->begun},
         {"contacts", out.entries},
         {"left_out", told->leftOut + out.more},
         {"not_looked_at", told->notLookedAt}},
        {}};
}

/// Events or distances of one frame.
template <typename Told>
Answer showFrame(const Told& told, std::string_view what, const Listing& out) {
    Answer answer;
    answer.text = out.table.text() + fmt::format("{} {} in frame {}{}{}\n", out.rows + out.more, what, told.frame.value,
                                                 notListed(told.leftOut, "found than are listed"),
                                                 notListed(out.more, "than --limit"));
    answer.json = {
        {"frame", told.frame.value}, {std::string(what), out.entries}, {"left_out", told.leftOut + out.more}};
    return answer;
}

/// Puts two answers about one frame, or about two that follow each other, together.
void add(Answer& to, Answer more) {
    to.text += more.text;
    if (to.json.is_null())
        to.json = std::move(more.json);
    else
        for (auto& [key, value] : more.json.items())
            if (key != "frame" && key != "left_out") to.json[key] = value;
}

Expected<Answer> showEventsAndDistances(Application& application, const verb::Contacts& wanted, ObjectId interest) {
    SceneNames names(application);
    Answer answer;
    if (wanted.events) {
        const Expected<answer::PairEvents> told = application.pairEvents();
        if (!told) return tl::unexpected(told.error());
        add(answer, showFrame(*told, "events", listed(*told, names, wanted, interest)));
    }
    if (wanted.distances) {
        const Expected<answer::Distances> told = application.distances();
        if (!told) return tl::unexpected(told.error());
        add(answer, showFrame(*told, "distances", listed(*told, names, wanted, interest)));
    }
    return answer;
}

/// Prints what each frame brings; frames that bring nothing are silent, and counted.
class Follower {
public:
    Follower(Application& application, const verb::Contacts& wanted, ObjectId interest, bool json, const Print& print,
             const Print& warn)
        : application_(application),
          names_(application),
          wanted_(wanted),
          interest_(interest),
          json_(json),
          print_(print),
          warn_(warn) {}

    Expected<Answer> run() {
        application_.onLost([this](const Error& why) { warn_("tessera-ctl: " + why.message + "; dialling again\n"); });
        const bool events = wanted_.events || !wanted_.distances;
        if (events)
            if (auto done = application_.onPairEvents(
                    [&](const answer::PairEvents& told) { frame(told, "events", eventFrames_); },
                    {.stays = wanted_.stays});
                !done)
                return tl::unexpected(done.error());
        if (wanted_.distances)
            if (auto done = application_.onDistances(
                    [&](const answer::Distances& told) { frame(told, "distances", distanceFrames_); });
                !done)
                return tl::unexpected(done.error());
        const auto enough = [&](bool asked, std::int64_t frames) { return !asked || frames >= wanted_.frames; };
        while (wanted_.frames == 0 || !enough(events, eventFrames_) || !enough(wanted_.distances, distanceFrames_)) {
            const Expected<bool> polled = application_.poll(1s);
            if (polled) continue;
            if (application_.serverIsOver()) break;
            return tl::unexpected(polled.error());
        }
        return Answer{
            fmt::format("followed {} frames, {} entries\n", std::max(eventFrames_, distanceFrames_), entries_), {}, {}};
    }

private:
    template <typename Told>
    void frame(const Told& told, std::string_view what, std::int64_t& frames) {
        if (wanted_.frames != 0 && frames >= wanted_.frames) return;
        ++frames;
        if (entriesOf(told).empty() && told.leftOut == 0) return;
        names_.refresh();
        const Listing out = listed(told, names_, wanted_, interest_);
        if (out.rows == 0 && told.leftOut == 0) return;
        entries_ += out.rows + out.more;
        const Answer answer = showFrame(told, what, out);
        print_(json_ ? jsonLine(answer.json) : answer.text);
    }

    static const std::vector<PairEventValue>& entriesOf(const answer::PairEvents& told) { return told.events; }
    static const std::vector<PairDistanceValue>& entriesOf(const answer::Distances& told) { return told.distances; }

    Application& application_;
    SceneNames names_;
    const verb::Contacts& wanted_;
    ObjectId interest_;
    bool json_;
    const Print &print_, &warn_;
    std::int64_t eventFrames_ = 0, distanceFrames_ = 0;
    std::size_t entries_ = 0;
};

/// Sets what is drawn of the contacts of one interest or of all.
Expected<Answer> drawContacts(Application& application, std::int64_t show, ObjectId interest) {
    std::vector<ObjectId> interests = {interest};
    if (!interest) {
        const Expected<std::map<ObjectId, ObjectId>> all = interestsOf(application);
        if (!all) return tl::unexpected(all.error());
        interests.clear();
        for (const auto& [core, holder] : *all) interests.push_back(core);
    }
    if (interests.empty()) return fail(ErrorCode::kNotFound, "the scene has no Interest whose contacts could be drawn");
    ChangeListBuilder edits;
    for (const ObjectId id : interests) edits.set(id, typeOf<Interest>(), fieldId<&Interest::show>, toValue(show));
    const Expected<answer::Committed> committed = application.propose(edits.take());
    if (!committed) return tl::unexpected(committed.error());
    SceneNames places(application);
    places.learnInterests(interests);
    Json names = Json::array();
    for (const ObjectId id : interests) names.push_back(places.interest(id));
    return Answer{fmt::format("drawn of the contacts of {} interests: {} (change {})\n", interests.size(),
                              *wordOfNumber(showField(), show), committed->sequence.value),
                  {{"sequence", committed->sequence.value},
                   {"show", *wordOfNumber(showField(), show)},
                   {"interests", std::move(names)}},
                  {}};
}

Json poseJson(const Pose& pose) {
    const Quatd& q = pose.rotation;
    return {{"translation", jsonOf(pose.translation)},
            {"rotation", Json::array({q.w(), q.x(), q.y(), q.z()})},
            {"scale", jsonOf(pose.scale)}};
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Contacts& wanted, bool json, const Print& print,
                     const Print& warn) {
    const Expected<ObjectId> interest = wantedInterest(application, wanted);
    if (!interest) return tl::unexpected(interest.error());
    if (wanted.show) return drawContacts(application, *wanted.show, *interest);
    if (wanted.follow) return Follower(application, wanted, *interest, json, print, warn).run();
    if (wanted.events || wanted.distances) return showEventsAndDistances(application, wanted, *interest);
    return showContacts(application, wanted, *interest);
}

Expected<Answer> run(Application& application, const verb::Questions&) {
    const Expected<answer::Questions> told = application.questions();
    if (!told) return tl::unexpected(told.error());
    SceneNames names(application);
    std::vector<ObjectId> nodes, interests;
    for (const QuestionValue& q : told->questions) {
        nodes.insert(nodes.end(), {q.objectA, q.objectB});
        interests.push_back(q.interest);
    }
    names.learn(nodes);
    names.learnInterests(interests);
    TextTable table({"question", "objects", "stands at", "wants to", "point", "interest"});
    Json list = Json::array();
    for (const QuestionValue& q : told->questions) {
        table.add({fmt::format("{}", q.id), names.pair(q.objectA, q.objectB), textOf(q.present.translation),
                   textOf(q.wanted.translation), textOf(q.point), names.interest(q.interest)});
        list.push_back({{"question", q.id},
                        {"objects", names.pairJson(q.objectA, q.objectB)},
                        {"transform", q.transform.value},
                        {"present", poseJson(q.present)},
                        {"wanted", poseJson(q.wanted)},
                        {"point", jsonOf(q.point)},
                        {"normal", jsonOf(q.normal)},
                        {"interest", names.interestJson(q.interest)}});
    }
    return Answer{table.text() + fmt::format("{} questions are open in frame {}\n", list.size(), told->frame.value),
                  {{"frame", told->frame.value}, {"questions", std::move(list)}},
                  {}};
}

Expected<Answer> run(Application& application, const verb::Respond& decision) {
    Pose pose;
    if (decision.decision == QuestionReply::Decision::kMove) {
        // Rotation and scale stay as they are where it was stopped.
        const Expected<answer::Questions> told = application.questions();
        if (!told) return tl::unexpected(told.error());
        const auto asked = std::ranges::find(told->questions, decision.question, &QuestionValue::id);
        if (asked == told->questions.end())
            return fail(ErrorCode::kRefused,
                        fmt::format("question {} is not open; see questions for those that are", decision.question));
        pose = asked->present;
        pose.translation = decision.place;
    }
    const Expected<void> done = application.respond(decision.question, decision.decision, pose);
    if (!done) return tl::unexpected(done.error());
    return Answer{fmt::format("question {} is answered\n", decision.question),
                  {{"question", decision.question}, {"done", true}},
                  {}};
}

Answer whatStopped(Application& application, std::span<const ObjectId> transforms) {
    Answer answer;
    answer.json = Json::array();
    const Expected<answer::Contacts> told = application.contacts();
    if (!told) return answer;  // it was stopped all the same; by what is not known
    SceneNames names(application);
    std::vector<ObjectId> nodes;
    for (const ContactValue& c : told->contacts) nodes.insert(nodes.end(), {c.objectA, c.objectB});
    names.learnWithAncestors(nodes);
    // Of those with others, that are more than reported; what something rests on has not stopped it, if anything else
    // has.
    std::vector<ObjectId> interests;
    for (const ContactValue& c : told->contacts)
        if (c.interest) interests.push_back(c.interest);
    std::ranges::sort(interests);
    interests.erase(std::unique(interests.begin(), interests.end()), interests.end());
    const Expected<SceneExcerpt> asked = application.fetch(interests);
    const auto reports = [&](ObjectId core) {
        const Interest* interest = core && asked ? asked->get<Interest>(core) : nullptr;
        return interest != nullptr && interest->response == Interest::kReport;
    };
    const auto concerns = [&](const ContactValue& c) {
        return !reports(c.interest) && names.hangsOn(c.objectA, transforms) != names.hangsOn(c.objectB, transforms);
    };
    const bool met =
        std::ranges::any_of(told->contacts, [&](const ContactValue& c) { return c.time < 1 && concerns(c); });
    std::set<std::pair<ObjectId, ObjectId>> pairs;
    for (const ContactValue& c : told->contacts) {
        if (!concerns(c) || (met && c.time >= 1)) continue;
        const bool a = names.hangsOn(c.objectA, transforms);
        const ObjectId mine = a ? c.objectA : c.objectB, other = a ? c.objectB : c.objectA;
        if (!pairs.emplace(mine, other).second) continue;
        names.learnInterests(std::span(&c.interest, 1));
        const Vec3d normal = a ? c.normal : Vec3d(-c.normal);
        const Json ofA = patchJson(c.patchA, c.patchUvA), ofB = patchJson(c.patchB, c.patchUvB);
        answer.text +=
            fmt::format("{} was stopped by {} at {}\n", names.node(mine), names.node(other), textOf(c.point));
        answer.json.push_back(
            {{"object", names.node(mine)},
             {"by", names.node(other)},
             {"faces", Json::array({faceJson(a ? c.faceA : c.faceB), faceJson(a ? c.faceB : c.faceA)})},
             {"patches", a ? Json::array({ofA, ofB}) : Json::array({ofB, ofA})},
             {"point", jsonOf(c.point)},
             {"normal", jsonOf(normal)},
             {"time", c.time},
             {"interest", names.interestJson(c.interest)}});
    }
    return answer;
}

}  // namespace tessera
