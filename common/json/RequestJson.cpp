#include "common/json/RequestJson.h"

#include "common/json/MemberJson.h"

namespace tessera {
namespace {

constexpr std::size_t kMostNames = 64;  ///< in one request: each costs the server a look

template <typename... R>
ApiExpected<ReadRequest> readOneOf(std::type_identity<std::variant<R...>>, std::string_view name, const Json& fields,
                                   JsonSurroundings& around) {
    ApiExpected<ReadRequest> read = tl::unexpected(
        ApiError{ErrorCode::kNotFound, fmt::format("there is no request \"{}\": GET /api has all of them", name), {}});
    const auto tryOne = [&]<typename One>(std::type_identity<One>) {
        if (One::kInfo.name != name) return;
        One request{};
        MemberJsonReader reader(around);
        if (!fields.is_null()) reader.take(request, fields);
        reader.check(request);
        if (reader.fault())
            read = tl::unexpected(*reader.fault());
        else
            read = ReadRequest{std::move(request), std::move(around.arrays)};
    };
    (tryOne(std::type_identity<R>{}), ...);
    return read;
}

template <typename Told>
SaidJson saidJson(const Told& told, Binaries& binaries) {
    return std::visit(
        [&]<typename T>(const T& value) {
            return SaidJson{T::kInfo.name, MemberJsonWriter(binaries).write(value)};
        },
        told);
}

}  // namespace

std::optional<ObjectId> ObjectNames::find(const std::string& name) {
    const auto known = known_.find(name);
    if (known != known_.end()) return known->second;
    // What is wanted is as good as known for the moment, so that one reading finds all that is.
    if (!wanted_.contains(name) && wanted_.size() >= kMostNames) return std::nullopt;
    wanted_.insert(name);
    return kRootNode;
}

ApiExpected<ReadRequest> readRequest(std::string_view name, const Json& fields, std::span<const ByteSlice> binaries,
                                     ObjectNames& names) {
    JsonSurroundings around{binaries, [&](const std::string& text) { return names.find(text); }, {}};
    return readOneOf(std::type_identity<ApplicationRequest>{}, name, fields, around);
}

SaidJson answerJson(const ApplicationAnswer& answer, Binaries& binaries) {
    return saidJson(answer, binaries);
}
SaidJson noticeJson(const ApplicationNotice& notice, Binaries& binaries) {
    return saidJson(notice, binaries);
}

}  // namespace tessera
