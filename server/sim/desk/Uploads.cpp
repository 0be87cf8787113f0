#include "server/sim/desk/Uploads.h"

#include <algorithm>

#include <fmt/format.h>

namespace tessera {

Uploads::Uploads(std::function<void(UploadFinished)> onFinished, const Limits& limits, const MakeLane& lane)
    : limits_(limits), onFinished_(std::move(onFinished)), lane_(lane({.nice = 19})) {}

std::optional<Error> Uploads::tooMuch(const Coming& coming, const message::Upload& piece) const {
    std::uint64_t more = 0;
    for (const BlobInfo& blob : piece.blobs) {
        if (blob.sizeBytes > limits_.maxBytes)
            return Error{ErrorCode::kLimit, fmt::format("an array of {} bytes; a proposal may bring {} MiB",
                                                        blob.sizeBytes, limits_.maxBytes >> 20)};
        more += blob.sizeBytes;
    }
    if (coming.sent + piece.bytes.size() > coming.bytes + more)
        return Error{ErrorCode::kBadInput, "bytes came that belong to no array"};
    if (coming.bytes + more > limits_.maxBytes)
        return Error{ErrorCode::kLimit,
                     fmt::format("arrays of more than {} MiB; a proposal may bring that many", limits_.maxBytes >> 20)};
    if (coming.blobs + piece.blobs.size() > limits_.maxBlobs)
        return Error{ErrorCode::kLimit,
                     fmt::format("more than {} arrays; a proposal may bring that many", limits_.maxBlobs)};
    if (claimedBytes_ + more > limits_.maxBytesOfAll || held_ + piece.bytes.size() > limits_.maxBytesOfAll)
        return Error{ErrorCode::kLimit, fmt::format("applications send arrays of {} MiB already; try again later",
                                                    std::max<std::uint64_t>(claimedBytes_, held_) >> 20)};
    return std::nullopt;
}

void Uploads::take(ConnectionId connection, const message::Upload& piece) {
    const auto [found, fresh] = coming_.try_emplace(connection);
    Coming& coming = found->second;
    if (fresh) coming.upload = ++lastUpload_;
    if (coming.refused) return;
    coming.refused = tooMuch(coming, piece);
    if (!coming.refused && waiting_ >= limits_.maxPieces)
        coming.refused = Error{ErrorCode::kLimit, "arrays came in too many pieces at once; try again later"};
    if (coming.refused) return;
    ++waiting_;
    held_ += piece.bytes.size();
    coming.sent += piece.bytes.size();
    lane_->post([this, upload = coming.upload, piece] { put(upload, piece); });
    for (const BlobInfo& blob : piece.blobs) coming.bytes += blob.sizeBytes;
    coming.blobs += piece.blobs.size();
    claimedBytes_ += coming.bytes - std::exchange(claimed_[coming.upload], coming.bytes);
}

Expected<Uploads::Closed> Uploads::close(ConnectionId connection) {
    const auto found = coming_.find(connection);
    if (found == coming_.end()) return Closed{};
    if (found->second.refused) {
        Error refused = std::move(*found->second.refused);
        drop(connection);
        return tl::unexpected(std::move(refused));
    }
    const Closed closed{found->second.upload, found->second.bytes};
    coming_.erase(found);
    lane_->post([this, upload = closed.upload] { finishUpload(upload, true); });
    return closed;
}

void Uploads::drop(ConnectionId connection) {
    const auto found = coming_.find(connection);
    if (found == coming_.end()) return;
    const std::uint64_t upload = found->second.upload;
    if (claimed_.contains(upload)) lane_->post([this, upload] { finishUpload(upload, false); });
    handedOver(upload);
    coming_.erase(found);
}

void Uploads::handedOver(std::uint64_t upload) {
    const auto claimed = claimed_.find(upload);
    if (claimed == claimed_.end()) return;
    claimedBytes_ -= claimed->second;
    claimed_.erase(claimed);
}

void Uploads::letGo(std::vector<Blob> blobs) {
    if (!blobs.empty()) lane_->post([gone = std::move(blobs)] {});
}

void Uploads::letGo(std::vector<std::shared_ptr<const void>> unneeded) {
    if (!unneeded.empty()) lane_->post([gone = std::move(unneeded)] {});
}

// ---- the lane

void Uploads::put(std::uint64_t upload, const message::Upload& piece) {
    --waiting_;
    Assembly& assembly = assemblies_[upload];
    assembly.held += piece.bytes.size();
    add(assembly, piece);
    if (assembly.error) held_ -= std::exchange(assembly.held, 0);  // it has thrown all away
}

void Uploads::finishUpload(std::uint64_t upload, bool wanted) {
    auto assembly = assemblies_.extract(upload);
    if (!assembly) return;
    const std::uint64_t held = assembly.mapped().held;
    if (wanted) onFinished_({upload, finish(std::move(assembly.mapped()))});
    assembly = {};
    held_ -= held;
}

void Uploads::add(Assembly& assembly, const message::Upload& piece) {
    assembly.expected.insert(assembly.expected.end(), piece.blobs.begin(), piece.blobs.end());
    ByteSpan rest = piece.bytes;
    while (!assembly.error && !assembly.expected.empty()) {
        const BlobInfo& blob = assembly.expected.front();
        if (!assembly.first) {
            assembly.first.emplace(blob.sizeBytes);
            assembly.filled = 0;
        }
        const std::uint64_t missing = blob.sizeBytes - assembly.filled;
        const ByteSpan mine = rest.first(static_cast<std::size_t>(std::min<std::uint64_t>(rest.size(), missing)));
        assembly.first->write(assembly.filled, mine);
        assembly.filled += mine.size();
        rest = rest.subspan(mine.size());
        if (assembly.filled < blob.sizeBytes) return;
        assembly.whole.push_back(assembly.first->finish());
        assembly.first.reset();
        if (assembly.whole.back().id() != blob.id)
            assembly.error =
                Error{ErrorCode::kBadInput, fmt::format("array {} came damaged: its bytes hash to {}", toHex(blob.id),
                                                        toHex(assembly.whole.back().id()))};
        assembly.expected.pop_front();
    }
    if (!rest.empty() && !assembly.error)
        assembly.error = Error{ErrorCode::kBadInput, "bytes came that belong to no array"};
    if (assembly.error)
        assembly = {.expected = {},
                    .first = {},
                    .filled = 0,
                    .whole = {},
                    .held = assembly.held,
                    .error = std::move(assembly.error)};
}

Expected<std::vector<Blob>> Uploads::finish(Assembly assembly) {
    if (assembly.error) return tl::unexpected(std::move(*assembly.error));
    if (!assembly.expected.empty())
        return fail(ErrorCode::kBadInput,
                    fmt::format("the proposal came before its arrays: {} bytes of array {} are missing",
                                assembly.expected.front().sizeBytes - (assembly.first ? assembly.filled : 0),
                                toHex(assembly.expected.front().id)));
    return std::move(assembly.whole);
}

}  // namespace tessera
