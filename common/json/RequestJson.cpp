#include "common/json/RequestJson.h"

#include <fmt/format.h>

#include "common/json/MemberJson.h"
#include "common/request/ApplicationLimits.h"
#include "common/request/Said.h"

namespace tessera {
namespace {

constexpr std::size_t kMostNames = 64;  ///< in one request: each costs the server a look

template <typename Told>
SaidJson saidJson(const Told& told, Binaries& binaries) {
    const SaidKind<Told>& kind = kindsOf<Told>()[told.index()];
    return {kind.name, memberJson(*kind.description, valueIn(told), binaries)};
}

}  // namespace

Expected<ObjectId> ObjectNames::find(const std::string& name, const std::string& path) {
    const auto known = known_.find(name);
    if (known != known_.end()) return known->second;
    if (name.size() > ApplicationLimits().maxTextBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("has {} bytes; at most {} are allowed", name.size(), ApplicationLimits().maxTextBytes));
    // What is wanted is as good as known for the moment, so that one reading finds all that is.
    if (!wanted_.contains(name) && wanted_.size() >= kMostNames)
        return fail(ErrorCode::kLimit, fmt::format("at most {} objects of a request may have a path in place of a "
                                                   "number (\"#17\")",
                                                   kMostNames));
    wanted_.emplace(name, path);
    return kRootNode;
}

ApiExpected<ReadRequest> readRequest(std::string_view name, const Json& fields, std::span<const ByteSlice> binaries,
                                     ObjectNames& names) {
    JsonSurroundings around{
        binaries, [&](const std::string& text, const std::string& path) { return names.find(text, path); }, {}};
    const SaidKind<ApplicationRequest>* const kind = requestKind(name);
    if (kind == nullptr)
        return tl::unexpected(
            ApiError{ErrorCode::kNotFound,
                     fmt::format("there is no request \"{}\": GET /api has all of them", shortened(name)),
                     {}});
    ApplicationRequest request;
    void* const value = kind->make(request);
    MemberJsonReader reader(around);
    if (!fields.is_null()) reader.take(*kind->description, value, fields);
    reader.check(*kind->description, value);
    if (reader.fault()) return tl::unexpected(*reader.fault());
    return ReadRequest{std::move(request), std::move(around.arrays)};
}

SaidJson answerJson(const ApplicationAnswer& answer, Binaries& binaries) {
    return saidJson(answer, binaries);
}
SaidJson noticeJson(const ApplicationNotice& notice, Binaries& binaries) {
    return saidJson(notice, binaries);
}

}  // namespace tessera
