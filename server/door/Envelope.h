/// A message on a WebSocket: what surrounds a request's fields.
#pragma once

#include <optional>

#include <memory>

#include "common/change/ChangeList.h"
#include "common/json/RequestJson.h"

namespace tessera {

/// `{"id":7,"request":NAME,"fields":{…},"binaries":N}`
struct Envelope {
    static constexpr std::size_t kMaxBinaries = 1024;

    std::string id;  ///< JSON: a number or a text of at most 64 characters; empty: none was said
    std::string request;
    std::shared_ptr<const Json> fields;  ///< may be null
    std::size_t binaries = 0;            ///< that follow
};

/// Any text. Where something is wrong but an id could be read, it stands in `id`.
struct SaidEnvelope {
    ApiExpected<Envelope> envelope;
    std::string id = {};
};
[[nodiscard]] SaidEnvelope readEnvelope(std::string_view text);

/// Texts that are sent; `id` as an envelope has it.
[[nodiscard]] std::string answerText(const std::string& id, std::string_view name, const Json& fields,
                                     std::size_t binaries);
/// The texts of an answer as it came (codec ApplicationCodec), and its binaries.
struct SaidAnswer {
    std::string text;
    Binaries binaries;
    [[nodiscard]] std::size_t size() const;
};
[[nodiscard]] SaidAnswer sayAnswer(const std::string& id, const ByteSlice& answer);
[[nodiscard]] std::string errorText(const std::string& id, const ApiError& error);
[[nodiscard]] std::string noticeText(std::string_view name, const Json& fields, std::size_t binaries);
/// `{"changes":{"sequence":N,"list":{…}}}`; `whole`: the scene stands there, and all of it is to be asked for anew; so
/// it is where a list makes more than kMaxListedChanges.
inline constexpr std::size_t kMaxListedChanges = 20'000;
[[nodiscard]] std::string changesText(Sequence sequence, const ChangeList& list, bool whole);

}  // namespace tessera
