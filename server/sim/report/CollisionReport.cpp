#include "server/sim/report/CollisionReport.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/cores/Interest.h"

namespace tessera {

namespace {

using Json = nlohmann::ordered_json;

Json jsonOf(const Vec2d& v) {
    return Json::array({v.x(), v.y()});
}
Json jsonOf(const Vec3d& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

/// Null for a hull's.
Json faceOf(std::uint32_t face) {
    return face == Contact::kNoFace ? Json(nullptr) : Json(face);
}

/// Null for what is not looked at as a smooth surface.
Json patchOf(std::uint32_t patch, const Vec2d& uv) {
    if (patch == Contact::kNoFace) return nullptr;
    return {{"face", patch}, {"uv", jsonOf(uv)}};
}

std::string_view nameOf(Phase phase) {
    switch (phase) {
        case Phase::kBegan:
            return "began";
        case Phase::kStays:
            return "stays";
        case Phase::kEnded:
            break;
    }
    return "ended";
}

std::string_view nameOf(NotLookedAt::Reason reason) {
    switch (reason) {
        case NotLookedAt::Reason::kWork:
            return "work";
        case NotLookedAt::Reason::kSteps:
            return "steps";
        case NotLookedAt::Reason::kTooFast:
            return "too fast";
        case NotLookedAt::Reason::kNotFinite:
            break;
    }
    return "not finite";
}

/// Names nodes by their paths and interests by the path of the first node that holds them.
class Names {
public:
    explicit Names(const Aspect& scene) : scene_(scene) {
        for (const ObjectId id : scene.ids()) {
            const Node* node = scene.get<Node>(id);
            if (node && node->core && scene.get<Interest>(node->core)) holders_.try_emplace(node->core, id);
        }
    }
    [[nodiscard]] std::string node(ObjectId id) const { return pathOf(scene_, id); }
    /// Null for none.
    [[nodiscard]] Json interest(ObjectId id) const {
        if (!id) return nullptr;
        const auto holder = holders_.find(id);
        return node(holder == holders_.end() ? id : holder->second);
    }

private:
    const Aspect& scene_;
    std::map<ObjectId, ObjectId> holders_;
};

template <typename Value>
std::vector<Value> first(const std::vector<Value>& all, std::size_t most) {
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), most))};
}

}  // namespace

void CollisionReport::frameDone(const StepResult& step) {
    last_ = step.counters;
    contacts_ = step.contacts;
    distances_ = step.distances;
    notLookedAt_ = first(step.notLookedAt, kMaxNotLookedAt);
    standIns_ = first(step.standIns, kMaxNotLookedAt);
    begun_ += step.contactsBegun;
    pairsTested_ += last_.pairsTested;
    boxTests_ += last_.boxTests;
    triangleTests_ += last_.triangleTests;
    mostTests_ = std::max(mostTests_, last_.boxTests + last_.triangleTests);
    contactsLeftOut_ += last_.contactsLeftOut;
    eventsLeftOut_ += last_.eventsLeftOut;
    unanswered_ += last_.unanswered;
    notLookedAtCount_ += last_.notLookedAt;
    for (const PairEvent& event : step.events.changes()) {
        // One that touched on its way through began and ended in one event.
        eventsBegan_ += event.phase == Phase::kBegan || event.through;
        eventsEnded_ += event.phase == Phase::kEnded;
    }
}

nlohmann::ordered_json CollisionReport::toJson(const Aspect& scene) const {
    const Names names(scene);
    Json contacts = Json::array();
    for (const Contact& c : first(contacts_.all(), kMaxContacts))
        contacts.push_back({{"objects", {names.node(c.objectA), names.node(c.objectB)}},
                            {"faces", {faceOf(c.faceA), faceOf(c.faceB)}},
                            {"point", jsonOf(c.point)},
                            {"places", {jsonOf(c.uvA), jsonOf(c.uvB)}},
                            {"patches", {patchOf(c.patchA, c.patchUvA), patchOf(c.patchB, c.patchUvB)}},
                            {"normal", jsonOf(c.normal)},
                            {"depth", c.depth < 0 ? Json(nullptr) : Json(c.depth)},
                            {"error", c.error},
                            {"interest", names.interest(c.interest)},
                            {"time", c.time}});
    Json distances = Json::array();
    for (const PairDistance& d : first(distances_.all(), kMaxDistances))
        distances.push_back({{"objects", {names.node(d.objectA), names.node(d.objectB)}},
                             {"interest", names.interest(d.interest)},
                             {"phase", nameOf(d.phase)},
                             {"distance", d.distance},
                             {"error", d.error},
                             {"nodes", {names.node(d.nodeA), names.node(d.nodeB)}},
                             {"faces", {faceOf(d.faceA), faceOf(d.faceB)}},
                             {"points", {jsonOf(d.pointA), jsonOf(d.pointB)}}});
    Json notLookedAt = Json::array();
    for (const NotLookedAt& n : notLookedAt_) {
        Json nodes = Json::array({names.node(n.nodeA)});
        if (n.nodeB) nodes.push_back(names.node(n.nodeB));
        notLookedAt.push_back({{"nodes", std::move(nodes)}, {"reason", nameOf(n.reason)}});
    }
    Json standIns = Json::array();
    for (const StandIn& s : standIns_)
        standIns.push_back({{"node", names.node(s.node)}, {"asked", s.asked}, {"taken", s.taken}});
    const CollisionLimits limits;
    Json report;
    report["objects"] = last_.objects;
    report["skipped"] = last_.skipped;
    report["free_bodies"] = last_.freeBodies;
    report["asleep"] = last_.asleep;
    report["pairs_tested"] = pairsTested_;
    report["box_tests"] = boxTests_;
    report["triangle_tests"] = triangleTests_;
    report["contacts"] = begun_;
    report["contact_list"] = std::move(contacts);
    report["contacts_left_out"] = contactsLeftOut_;
    report["events"] = {{"began", eventsBegan_}, {"ended", eventsEnded_}, {"left_out", eventsLeftOut_}};
    report["distances"] = std::move(distances);
    report["unanswered"] = unanswered_;
    report["stand_ins"] = {{"count", last_.standIns}, {"list", std::move(standIns)}};
    report["not_looked_at"] = {{"count", notLookedAtCount_}, {"list", std::move(notLookedAt)}};
    report["budget"] = {{"max_tests", limits.maxTests},
                        {"largest_share", static_cast<double>(mostTests_) / static_cast<double>(limits.maxTests)}};
    return report;
}

}  // namespace tessera
