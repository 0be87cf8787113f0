#include "server/sim/peers/MarkArrays.h"

#include <algorithm>

#include "server/manipulators/ManipulatorDisplay.h"
#include "server/programs/ProgramNotices.h"
#include "server/sim/display/ContactDisplay.h"

namespace tessera {
namespace {

std::vector<Blob> arraysOfOurOwn() {
    std::vector<Blob> all = ContactDisplay::blobs();
    for (Blob& blob : ManipulatorDisplay::blobs()) all.push_back(std::move(blob));
    for (Blob& blob : ProgramNotices::blobs()) all.push_back(std::move(blob));
    return all;
}

}  // namespace

MarkArrays::MarkArrays(BlobStore& blobs, ServerSession& session) : session_(session), arrays_(arraysOfOurOwn()) {
    for (const Blob& blob : arrays_) blobs.add(blob);
}

ServerActions MarkArrays::announce(TimePoint now) {
    std::vector<BlobInfo> infos;
    for (const Blob& blob : arrays_) infos.push_back({blob.id(), blob.sizeBytes()});
    return session_.announceBlobs(token_--, std::move(infos), now);
}

ServerActions MarkArrays::named(std::span<const BlobInfo> blobs, TimePoint now) {
    const auto isMark = [&](const BlobInfo& info) {
        return std::ranges::any_of(arrays_, [&](const Blob& blob) { return blob.id() == info.id; });
    };
    return std::ranges::any_of(blobs, isMark) ? announce(now) : ServerActions();
}

}  // namespace tessera
