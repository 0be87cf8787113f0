#include "common/session/BlobAnnouncements.h"

#include <algorithm>
#include <utility>

namespace tessera {

std::vector<BlobAnnouncements::Token> BlobAnnouncements::announce(Token token, std::vector<BlobInfo> blobs,
                                                                  const std::vector<std::string>& told,
                                                                  std::set<std::string> awaited, TimePoint now) {
    for (const std::string& host : told) owed_[host].insert(token);
    announcements_.push_back(
        {.token = token, .blobs = std::move(blobs), .awaited = std::move(awaited), .fetching = {.since = now}});
    std::vector<Token> done = everywhere();
    if (announcements_.size() > most_) {
        const auto oldest = std::ranges::find_if(announcements_, &Announcement::everywhere);
        if (oldest != announcements_.end()) announcements_.erase(oldest);
    }
    return done;
}

std::vector<message::BlobNotice> BlobAnnouncements::owedNow(const std::string& host) {
    std::vector<message::BlobNotice> notices;
    for (const Announcement& announcement : announcements_)
        if (owed_[host].insert(announcement.token).second) notices.push_back({announcement.token, announcement.blobs});
    return notices;
}

bool BlobAnnouncements::owes(const std::string& host) const {
    const auto it = owed_.find(host);
    return it != owed_.end() && !it->second.empty();
}

void BlobAnnouncements::held(const std::string& host, Token token) {
    if (const auto it = owed_.find(host); it != owed_.end()) it->second.erase(token);
    for (Announcement& announcement : announcements_)
        if (announcement.token == token) announcement.awaited.erase(host);
}

void BlobAnnouncements::notAwaited(const std::string& host) {
    for (Announcement& announcement : announcements_) announcement.awaited.erase(host);
}

void BlobAnnouncements::comesAnew(const std::string& host) {
    owed_.erase(host);
}

std::vector<BlobAnnouncements::Token> BlobAnnouncements::everywhere() {
    std::vector<Token> done;
    for (Announcement& announcement : announcements_) {
        if (announcement.everywhere || !announcement.awaited.empty()) continue;
        announcement.everywhere = true;
        done.push_back(announcement.token);
    }
    return done;
}

void BlobAnnouncements::forget(Token token) {
    std::erase_if(announcements_, [&](const Announcement& announcement) { return announcement.token == token; });
}

void BlobAnnouncements::named(const std::vector<BlobInfo>& blobs) {
    if (announcements_.empty()) return;
    std::set<BlobId> ids;
    for (const BlobInfo& blob : blobs) ids.insert(blob.id);
    std::erase_if(announcements_, [&](const Announcement& announcement) {
        return announcement.everywhere &&
               std::ranges::all_of(announcement.blobs, [&](const BlobInfo& blob) { return ids.contains(blob.id); });
    });
}

void BlobAnnouncements::excuse(Duration time) {
    for (Announcement& announcement : announcements_) announcement.fetching.excuse(time, deadline_);
}

std::set<std::string> BlobAnnouncements::late(TimePoint now) const {
    std::set<std::string> hosts;
    for (const Announcement& announcement : announcements_)
        if (now >= announcement.fetching.deadline(deadline_))
            hosts.insert(announcement.awaited.begin(), announcement.awaited.end());
    return hosts;
}

TimePoint BlobAnnouncements::nextDeadline() const {
    TimePoint next = TimePoint::max();
    for (const Announcement& announcement : announcements_)
        if (!announcement.awaited.empty()) next = std::min(next, announcement.fetching.deadline(deadline_));
    return next;
}

}  // namespace tessera
