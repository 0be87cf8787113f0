#include "common/codec/ApplicationCodec.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/MemberCodec.h"
#include "common/request/Said.h"

namespace tessera {

namespace {

constexpr std::size_t kMaxApplicationHeadBytes = std::size_t{1} << 20;
/// Of answers and notices: images bring one for each tile, others three at most.
constexpr std::size_t kMostPartsOfNotice = 2;

/// The name of a kind of message, and the words for one that nobody knows.
struct SaidWords {
    std::string_view kind, unknown;
};
constexpr SaidWords kRequestWords{"request", "it asks for something that this version does not know"},
    kAnswerWords{"answer", "it says something that this version does not know"},
    kNoticeWords{"notice", kAnswerWords.unknown};

/// A head consists of one message, whose number says what it is.
template <typename Variant>
Bytes encode(const Variant& said) {
    const SaidKind<Variant>& kind = kindsOf<Variant>()[said.index()];
    MemberWriter writer;
    return writer.joined(kind.number, *kind.description, valueIn(said));
}

template <typename Variant>
Expected<Variant> decode(const ByteSlice& bytes, std::size_t maxParts, const ApplicationLimits& limits,
                         const SaidWords& words, const MayNotAsk& mayNot = nullptr) {
    auto split = splitParts(bytes, kMaxApplicationHeadBytes, maxParts);
    if (!split) return failWith(fmt::format("a malformed {}", words.kind), split.error());
    MemberReader in(bytes, std::move(split->parts), limits);
    Variant said;
    void* value = nullptr;
    const SaidKind<Variant>* kind = nullptr;
    std::optional<Error> refused;
    int number = 0;
    const auto all = kindsOf<Variant>();
    in.eachField(split->head, [&](const HeadField& field) {
        number = field.number;
        if (field.kind != HeadField::Kind::kBytes || refused) return;
        const auto found = std::ranges::find(all, field.number, &SaidKind<Variant>::number);
        if (found == all.end()) return;
        if (mayNot && (refused = mayNot(*found->info))) return;
        // The last one of several counts.
        if (kind != &*found) {
            kind = &*found;
            value = kind->make(said);
            in.clear(*kind->description, value);
        }
        in.take(*kind->description, value, field.bytes);
    });
    if (refused) return tl::unexpected(std::move(*refused));
    if (kind != nullptr) {
        in.finish(*kind->description, value);
        if (in.error()) return failWith(kind->name, *in.error());
        return said;
    }
    if (in.error()) return failWith(fmt::format("a malformed {}", words.kind), *in.error());
    if (std::is_same_v<Variant, ApplicationRequest> && std::ranges::count(kFormerRequests, number) > 0)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("request {} is no longer understood; take a newer program", number));
    return fail(ErrorCode::kUnsupported, fmt::format("a malformed {}: {}", words.kind, words.unknown));
}

}  // namespace

Bytes encodeRequest(const ApplicationRequest& request) {
    return encode(request);
}

Expected<ApplicationRequest> decodeRequest(const ByteSlice& bytes, const ApplicationLimits& limits,
                                           const MayNotAsk& mayNot) {
    return decode<ApplicationRequest>(bytes, limits.maxBlobs + 1, limits, kRequestWords, mayNot);
}

Bytes encodeAnswer(const ApplicationAnswer& answer) {
    return encode(answer);
}

Expected<ApplicationAnswer> decodeAnswer(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<ApplicationAnswer>(bytes, limits.maxTiles, limits, kAnswerWords);
}

Bytes encodeNotice(const ApplicationNotice& notice) {
    return encode(notice);
}

Expected<ApplicationNotice> decodeNotice(const ByteSlice& bytes, const ApplicationLimits& limits) {
    return decode<ApplicationNotice>(bytes, kMostPartsOfNotice, limits, kNoticeWords);
}

}  // namespace tessera
