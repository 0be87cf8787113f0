#include "server/sim/audit/AuditBook.h"

#include <algorithm>

namespace tessera {
namespace {

/// Whoever names things names them as long as they like.
std::string shortened(const std::string& text) {
    constexpr std::string_view kCut = "…";
    if (text.size() <= AuditBook::kMostBytes) return text;
    return std::string(kCut) + text.substr(text.size() - (AuditBook::kMostBytes - kCut.size()));
}

}  // namespace

void AuditBook::came(ConnectionId connection, Application application) {
    applications_.insert_or_assign(connection, Present{std::move(application)});
}

void AuditBook::left(ConnectionId connection, const std::function<bool(std::uint64_t)>& isUnderWay) {
    const auto known = applications_.find(connection);
    if (known == applications_.end()) return;
    known->second.gone = true;
    for (auto it = open_.lower_bound({connection, 0}); it != open_.end() && it->first.first == connection;)
        it = isUnderWay(it->first.second) ? std::next(it) : open_.erase(it);
    forgetGone(connection);
}

void AuditBook::forgetGone(ConnectionId connection) {
    const auto known = applications_.find(connection);
    const auto open = open_.lower_bound({connection, 0});
    if (known != applications_.end() && known->second.gone && (open == open_.end() || open->first.first != connection))
        applications_.erase(known);
}

std::uint64_t AuditBook::asked(ConnectionId connection, const RequestInfo& info, const std::string& from) {
    if (info.role == Role::kViewer) return 0;
    open_.emplace(std::pair(connection, ++lastDeed_), Deed{.did = info.name, .from = from});
    return lastDeed_;
}

void AuditBook::mayNot(ConnectionId connection, const RequestInfo& info, const std::string& why,
                       const std::string& from) {
    note(connection, {.did = info.name, .from = from}, why);
}

bool AuditBook::wantsObjects(ConnectionId connection, std::uint64_t number) const {
    const auto deed = open_.find({connection, number});
    if (deed == open_.end() || !deed->second.objects.empty()) return false;
    const auto line = lines_.find(keyOf(connection, deed->second, false));
    return line == lines_.end() || line->second.objects.size() < kMostObjects;
}

void AuditBook::names(ConnectionId connection, std::uint64_t number, std::vector<std::string> objects) {
    if (const auto deed = open_.find({connection, number}); deed != open_.end())
        deed->second.objects = std::move(objects);
}

void AuditBook::changes(ConnectionId connection, std::uint64_t number, std::uint64_t count) {
    if (const auto deed = open_.find({connection, number}); deed != open_.end()) deed->second.changes += count;
}

void AuditBook::answered(ConnectionId connection, std::uint64_t number, bool done) {
    const auto deed = open_.find({connection, number});
    if (deed == open_.end()) return;
    if (done) note(connection, std::move(deed->second));
    open_.erase(deed);
    forgetGone(connection);
}

void AuditBook::byHand(std::vector<std::string> objects, std::uint64_t changes) {
    note(ConnectionId(), {.did = "dragged by hand", .objects = std::move(objects), .changes = changes});
}

/// Whoever has many addresses fills no file by them.
AuditBook::LineKey AuditBook::keyOf(ConnectionId connection, const Deed& deed, bool refused) const {
    LineKey key(connection, deed.did, refused, deed.from);
    if (lines_.contains(key)) return key;
    const auto first = lines_.lower_bound({connection, deed.did, refused, {}});
    const auto other = std::find_if(first, lines_.end(), [&](const auto& line) {
        return std::get<0>(line.first) != connection || std::get<1>(line.first) != deed.did ||
               std::get<2>(line.first) != refused;
    });
    if (std::distance(first, other) >= kMostPlaces) std::get<std::string>(key) = "others";
    return key;
}

AuditLine& AuditBook::lineOf(ConnectionId connection, const Deed& deed, const std::string& refused) {
    const auto [line, isNew] = lines_.try_emplace(keyOf(connection, deed, !refused.empty()));
    if (!isNew) {
        ++line->second.times;
        return line->second;
    }
    const auto known = applications_.find(connection);
    // Who stands before the wall comes by no connection.
    const Application who =
        known != applications_.end() ? known->second.who : Application{{.role = Role::kEditor}, "the wall itself", ""};
    const std::string& from = std::get<std::string>(line->first);
    line->second = {time_.date(), who.who, shortened(who.program), from.empty() ? who.from : shortened(from),
                    std::string(deed.did)};
    line->second.who.name = shortened(who.who.name);
    line->second.refused = shortened(refused);
    return line->second;
}

void AuditBook::note(ConnectionId connection, Deed deed, const std::string& refused) {
    AuditLine& line = lineOf(connection, deed, refused);
    line.changes += deed.changes;
    for (const std::string& each : deed.objects) {
        if (line.objects.size() == kMostObjects) break;
        std::string object = shortened(each);
        if (std::ranges::find(line.objects, object) == line.objects.end()) line.objects.push_back(std::move(object));
    }
    if (due_ == TimePoint::max()) due_ = time_.now() + kTogether;
}

void AuditBook::advance(TimePoint now) {
    if (now < due_) return;
    handOver();
}

void AuditBook::handOver() {
    due_ = TimePoint::max();
    std::vector<AuditLine> lines;
    for (auto& [key, line] : lines_) lines.push_back(std::move(line));
    lines_.clear();
    std::ranges::stable_sort(lines, {}, &AuditLine::at);
    if (!lines.empty()) write_(std::move(lines));
}

}  // namespace tessera
