#include "common/session/BlobFetcher.h"

#include <algorithm>

namespace tessera {

Expected<std::vector<Blob>> BlobFetcher::want(const std::vector<BlobInfo>& blobs) {
    std::vector<Blob> complete;
    const std::size_t before = order_.size();
    for (const BlobInfo& blob : blobs) {
        if (held_.contains(blob.id)) continue;
        if (const auto known = fetches_.find(blob.id); known != fetches_.end()) {
            known->second.wanted = ++wishes_;
            continue;
        }
        if (blob.sizeBytes > limits_.maxBlobBytes)
            return fail(ErrorCode::kLimit, "blob " + toHex(blob.id) + " has " + std::to_string(blob.sizeBytes) +
                                               " bytes, more than the " + std::to_string(limits_.maxBlobBytes) +
                                               " allowed here");
        if (blob.sizeBytes == 0) {
            complete.emplace_back(Bytes{});
            if (complete.back().id() != blob.id)
                return fail(ErrorCode::kBadInput,
                            "blob " + toHex(blob.id) + " is announced as empty, but its name says otherwise");
            held_.insert(blob.id);
            continue;
        }
        if (Blob found = lookElsewhere(blob, sceneKnown_); !found.empty()) {
            held_.insert(blob.id);
            complete.push_back(std::move(found));
            continue;
        }
        Fetch& fetch = fetches_[blob.id];
        if (auto part = parts_.extract(blob.id); part && part.mapped().sizeBytes == blob.sizeBytes)
            fetch = std::move(part.mapped());
        fetch.sizeBytes = blob.sizeBytes;
        fetch.late = sceneKnown_;
        fetch.begun = fetch.wanted = ++wishes_;
        order_.push_back(blob.id);
    }
    if (limits_.elsewhere) {
        const auto first = order_.begin() + static_cast<std::ptrdiff_t>(before);
        const auto wanted = static_cast<double>(order_.end() - first);
        std::rotate(first, first + static_cast<std::ptrdiff_t>(std::clamp(limits_.firstShare, 0.0, 1.0) * wanted),
                    order_.end());
    }
    return complete;
}

Expected<std::vector<Blob>> BlobFetcher::wantScene(const BlobInfo& blob) {
    std::erase_if(parts_, [&](const auto& part) { return part.second.scene && part.first != blob.id; });
    Expected<std::vector<Blob>> complete = want({blob});
    if (const auto fetch = fetches_.find(blob.id); fetch != fetches_.end()) fetch->second.scene = true;
    return complete;
}

Blob BlobFetcher::lookElsewhere(const BlobInfo& blob, bool late) const {
    if (!limits_.elsewhere || (late && blob.sizeBytes > limits_.maxLateElsewhereBytes)) return {};
    return limits_.elsewhere(blob);
}

std::vector<message::BlobRequest> BlobFetcher::requests() {
    std::vector<message::BlobRequest> wanted;
    const auto ask = [&](const message::BlobRequest& request) {
        inFlight_.push_back({request, fetches_.at(request.id).wanted});
        wanted.push_back(request);
    };
    for (; !again_.empty() && inFlight_.size() < limits_.chunksInFlight; again_.pop_back()) ask(again_.back());
    while (!order_.empty() && inFlight_.size() < limits_.chunksInFlight) {
        Fetch& fetch = fetches_.at(order_.front());
        if (fetch.asked == 0) {
            if (Blob found = lookElsewhere({order_.front(), fetch.sizeBytes}, fetch.late); !found.empty()) {
                held_.insert(order_.front());
                fetches_.erase(order_.front());
                order_.pop_front();
                found_.push_back(std::move(found));
                continue;
            }
        }
        const auto length =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(limits_.chunkBytes, fetch.sizeBytes - fetch.asked));
        const message::BlobRequest request{order_.front(), fetch.asked, length};
        fetch.asked += length;
        if (fetch.asked == fetch.sizeBytes) order_.pop_front();
        ask(request);
    }
    return wanted;
}

void BlobFetcher::giveUp(const BlobId& id) {
    fetches_.erase(id);
    std::erase(order_, id);
    std::erase_if(again_, [&](const message::BlobRequest& request) { return request.id == id; });
}

Expected<std::optional<Blob>> BlobFetcher::chunk(const message::BlobChunk& chunk) {
    // Answers come in the order of the requests: where a chunk was asked for twice, this one is for the first.
    const auto asked = std::find_if(inFlight_.begin(), inFlight_.end(), [&](const Asked& one) {
        return one.request.id == chunk.id && one.request.offset == chunk.offset;
    });
    if (asked == inFlight_.end())
        return fail(ErrorCode::kBadInput, "a chunk of blob " + toHex(chunk.id) + " came that nobody asked for");
    const Asked was = *asked;
    const auto found = fetches_.find(chunk.id);
    if (found == fetches_.end() || was.wanted < found->second.begun) {  // it was given up since
        inFlight_.erase(asked);
        return std::optional<Blob>{};
    }
    Fetch& fetch = found->second;
    if (chunk.totalBytes == 0) {
        inFlight_.erase(asked);
        if (was.wanted < fetch.wanted) {  // it has been named anew: the server may have it again
            again_.push_back(was.request);
            return std::optional<Blob>{};
        }
        giveUp(chunk.id);
        return fail(ErrorCode::kNotFound, "the server does not have blob " + toHex(chunk.id));
    }
    if (chunk.totalBytes != fetch.sizeBytes || chunk.bytes.size() != was.request.length)
        return fail(ErrorCode::kBadInput, "a chunk of blob " + toHex(chunk.id) + " has the wrong size");
    inFlight_.erase(asked);
    if (!fetch.made)
        fetch.made = std::make_unique<BlobMaker>(fetch.sizeBytes,
                                                 limits_.place ? limits_.place({chunk.id, fetch.sizeBytes}) : nullptr);
    fetch.made->write(chunk.offset, chunk.bytes);
    fetch.end = std::max<std::uint64_t>(fetch.end, chunk.offset + chunk.bytes.size());
    fetch.received += chunk.bytes.size();
    if (fetch.received < fetch.sizeBytes) return std::optional<Blob>{};
    Blob blob = fetch.made->finish();
    fetches_.erase(chunk.id);
    if (blob.id() != chunk.id)
        return fail(ErrorCode::kBadInput,
                    "blob " + toHex(chunk.id) + " arrived damaged: its bytes hash to " + toHex(blob.id()));
    held_.insert(blob.id());
    return std::optional<Blob>{std::move(blob)};
}

void BlobFetcher::interrupted() {
    // Back to the first gap of each blob; blobs that were wholly asked for queue up again, before the others.
    std::vector<message::BlobRequest> all = std::exchange(again_, {});
    for (const Asked& asked : inFlight_) {
        const auto fetch = fetches_.find(asked.request.id);
        if (fetch != fetches_.end() && asked.wanted >= fetch->second.begun) all.push_back(asked.request);
    }
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.offset > b.offset; });
    for (const message::BlobRequest& lost : all) {
        Fetch& fetch = fetches_.at(lost.id);
        if (fetch.asked == fetch.sizeBytes) order_.push_front(lost.id);
        fetch.asked = lost.offset;
        fetch.received = lost.offset;
    }
    inFlight_.clear();
}

BlobFetcher::Parts BlobFetcher::takeParts() {
    interrupted();
    order_.clear();
    Parts parts;
    std::vector<std::pair<std::uint32_t, BlobId>> oldestLast;
    if (!sceneKnown_)
        for (auto& [id, part] : parts_) {
            oldestLast.emplace_back(++part.unwanted, id);
            parts.insert_or_assign(id, std::move(part));
        }
    std::sort(oldestLast.begin(), oldestLast.end());
    std::uint64_t bytes = 0;
    for (const auto& [unwanted, id] : oldestLast) {
        bytes += parts.at(id).end;
        if (bytes > limits_.maxUnwantedBytes) parts.erase(id);
    }
    for (auto& [id, fetch] : fetches_) {
        fetch.unwanted = 0;
        if (fetch.received > 0) parts.insert_or_assign(id, std::move(fetch));
    }
    fetches_.clear();
    parts_.clear();
    return parts;
}

}  // namespace tessera
