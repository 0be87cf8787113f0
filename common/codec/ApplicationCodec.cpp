#include "common/codec/ApplicationCodec.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/MemberCodec.h"

namespace tessera {

namespace {

constexpr std::size_t kMaxApplicationHeadBytes = std::size_t{1} << 20;
/// Of answers and notices: images bring one for each tile, others three at most.
constexpr std::size_t kMostPartsOfNotice = 2;

struct AsRequest {
    template <typename R>
    static constexpr int kNumber = R::kInfo.number;
    static constexpr std::string_view kKind = "request";
    static constexpr std::string_view kUnknown = "it asks for something that this version does not know";
};
struct AsAnswer {
    template <typename A>
    static constexpr int kNumber = A::kInfo.answer;
    static constexpr std::string_view kKind = "answer";
    static constexpr std::string_view kUnknown = "it says something that this version does not know";
};
struct AsNotice {
    template <typename N>
    static constexpr int kNumber = N::kInfo.notice;
    static constexpr std::string_view kKind = "notice";
    static constexpr std::string_view kUnknown = AsAnswer::kUnknown;
};

/// A head consists of one message, whose number says what it is.
template <typename As, typename Variant>
Bytes encode(const Variant& said) {
    return std::visit(
        []<typename T>(const T& value) {
            static_assert(As::template kNumber<T> > 0);
            MemberWriter writer;
            return writer.joined(As::template kNumber<T>, value);
        },
        said);
}

template <typename As, typename... T>
Expected<std::variant<T...>> decode(std::type_identity<std::variant<T...>>, const ByteSlice& bytes,
                                    std::size_t maxParts, const ApplicationLimits& limits,
                                    const MayNotAsk& mayNot = nullptr) {
    static_assert(numbersDiffer({As::template kNumber<T>...}), "two with one number");
    auto split = splitParts(bytes, kMaxApplicationHeadBytes, maxParts);
    if (!split) return failWith(fmt::format("a malformed {}", As::kKind), split.error());
    MemberReader in(bytes, std::move(split->parts), limits);
    std::optional<std::variant<T...>> said;
    std::optional<Error> refused;
    int number = 0;
    in.eachField(split->head, [&](const HeadField& field) {
        number = field.number;
        if (field.kind != HeadField::Kind::kBytes || refused) return;
        const auto tryOne = [&]<typename A>(std::type_identity<A>) {
            if (field.number != As::template kNumber<A>) return false;
            if constexpr (std::is_same_v<As, AsRequest>)
                if (mayNot && (refused = mayNot(A::kInfo))) return true;
            // Of several the last one counts.
            if (!said || !std::holds_alternative<A>(*said)) in.clear(std::get<A>(said.emplace(A{})));
            in.take(std::get<A>(*said), field.bytes);
            return true;
        };
        (void)(tryOne(std::type_identity<T>{}) || ...);
    });
    if (refused) return tl::unexpected(std::move(*refused));
    if (said) {
        std::visit([&](auto& value) { in.finish(value); }, *said);
        if (in.error())
            return failWith(std::visit([]<typename A>(const A&) { return A::kInfo.name; }, *said), *in.error());
        return std::move(*said);
    }
    if (in.error()) return failWith(fmt::format("a malformed {}", As::kKind), *in.error());
    if (std::is_same_v<As, AsRequest> && std::ranges::count(kFormerRequests, number) > 0)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("request {} is no longer understood; take a newer program", number));
    return fail(ErrorCode::kUnsupported, fmt::format("a malformed {}: {}", As::kKind, As::kUnknown));
}

}  // namespace

Bytes encodeRequest(const ApplicationRequest& request) {
    return encode<AsRequest>(request);
}

Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits,
                                           const MayNotAsk& mayNot) {
    return decode<AsRequest>(std::type_identity<ApplicationRequest>{}, bytes, limits.maxBlobs + 1, limits, mayNot);
}

Bytes encodeAnswer(const ApplicationAnswer& answer) {
    return encode<AsAnswer>(answer);
}

Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<AsAnswer>(std::type_identity<ApplicationAnswer>{}, bytes, limits.maxTiles, limits);
}

Bytes encodeNotice(const ApplicationNotice& notice) {
    return encode<AsNotice>(notice);
}

Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<AsNotice>(std::type_identity<ApplicationNotice>{}, bytes, kMostPartsOfNotice, limits);
}

}  // namespace tessera
