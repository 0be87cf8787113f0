#include "server/sim/audit/AuditBook.h"

#include <algorithm>

namespace tessera {

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

void AuditBook::asked(ConnectionId connection, std::uint64_t request, const RequestInfo& info) {
    if (info.role > Role::kViewer) open_.insert_or_assign({connection, request}, Deed{.did = info.name});
}

void AuditBook::mayNot(ConnectionId connection, const RequestInfo& info, const std::string& why) {
    note(connection, {.did = info.name}, why);
}

bool AuditBook::wantsObjects(ConnectionId connection, std::uint64_t request) const {
    const auto deed = open_.find({connection, request});
    if (deed == open_.end() || !deed->second.objects.empty()) return false;
    const auto line = lines_.find({connection, std::string(deed->second.did)});
    return line == lines_.end() || line->second.objects.size() < kMostObjects;
}

void AuditBook::names(ConnectionId connection, std::uint64_t request, std::vector<std::string> objects) {
    if (const auto deed = open_.find({connection, request}); deed != open_.end())
        deed->second.objects = std::move(objects);
}

void AuditBook::changes(ConnectionId connection, std::uint64_t request, std::uint64_t count) {
    if (const auto deed = open_.find({connection, request}); deed != open_.end()) deed->second.changes += count;
}

void AuditBook::answered(ConnectionId connection, std::uint64_t request, bool done) {
    const auto deed = open_.find({connection, request});
    if (deed == open_.end()) return;
    if (done) note(connection, std::move(deed->second));
    open_.erase(deed);
    forgetGone(connection);
}

void AuditBook::byHand(std::vector<std::string> objects, std::uint64_t changes) {
    note(ConnectionId(), {.did = "dragged by hand", .objects = std::move(objects), .changes = changes});
}

AuditLine& AuditBook::lineOf(ConnectionId connection, std::string_view did, const std::string& refused) {
    const auto [line, isNew] = lines_.try_emplace({connection, std::string(did) + refused});
    if (!isNew) {
        ++line->second.times;
        return line->second;
    }
    const auto known = applications_.find(connection);
    // Who stands before the wall comes by no connection.
    const Application who = known != applications_.end()
                                ? known->second.who
                                : Application{{.role = Role::kEditor}, "the wall itself", ""};
    line->second = {now_(), who.who, who.program, who.from, std::string(did)};
    line->second.refused = refused;
    return line->second;
}

void AuditBook::note(ConnectionId connection, Deed deed, const std::string& refused) {
    AuditLine& line = lineOf(connection, deed.did, refused);
    line.changes += deed.changes;
    for (std::string& object : deed.objects)
        if (line.objects.size() < kMostObjects && std::ranges::find(line.objects, object) == line.objects.end())
            line.objects.push_back(std::move(object));
    if (due_ == TimePoint::max()) due_ = std::chrono::steady_clock::now() + kTogether;
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
