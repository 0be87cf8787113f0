#include "server/door/Envelope.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/codec/ApplicationCodec.h"
#include "common/json/ChangeJson.h"

namespace tessera {

namespace {

ApiExpected<Envelope> envelopeIn(std::string_view text, std::string& id) {
    const auto refuse = [](const std::string& message, std::string field) {
        return tl::unexpected(ApiError{ErrorCode::kBadInput, message, std::move(field)});
    };
    ApiExpected<Json> json = parseJson(text);
    if (!json) return tl::unexpected(json.error());
    if (!json->is_object()) return refuse("a message is an object: {\"id\":1,\"request\":NAME}", "");
    Envelope envelope;
    // First, so that whatever is wrong can be told to the right one.
    if (const auto said = json->find("id"); said != json->end()) {
        const bool isText = said->is_string() && said->get_ref<const std::string&>().size() <= 64;
        if (!isText && !said->is_number_integer())
            return refuse("id: a whole number, or a text of at most 64 bytes, was expected", "id");
        envelope.id = id = jsonText(*said);
    }
    for (auto& [key, value] : json->items()) {
        if (key == "id") continue;
        if (key == "request") {
            if (!value.is_string()) return refuse("request: a request's name was expected", key);
            envelope.request = value.get<std::string>();
        } else if (key == "fields") {
            envelope.fields = std::make_shared<const Json>(std::move(value));
        } else if (key == "binaries") {
            if (!value.is_number_unsigned() || value.get<std::uint64_t>() > Envelope::kMaxBinaries)
                return refuse(fmt::format("binaries: a number from 0 to {} was expected", Envelope::kMaxBinaries), key);
            envelope.binaries = value.get<std::size_t>();
        } else {
            return refuse(fmt::format("{}: there is no such field; there are id, request, fields, binaries", key), key);
        }
    }
    if (envelope.request.empty()) return refuse("request: it is missing", "request");
    return envelope;
}

std::string opened(const std::string& id) {
    return id.empty() ? "{" : "{\"id\":" + id + ",";
}
std::string closed(const Json& fields, std::size_t binaries) {
    return "\"fields\":" + jsonText(fields) + (binaries > 0 ? fmt::format(",\"binaries\":{}}}", binaries) : "}");
}

}  // namespace

SaidEnvelope readEnvelope(std::string_view text) {
    std::string id;
    ApiExpected<Envelope> envelope = envelopeIn(text, id);
    return {std::move(envelope), std::move(id)};
}

std::string answerText(const std::string& id, std::string_view name, const Json& fields, std::size_t binaries) {
    return fmt::format("{}\"answer\":\"{}\",{}", opened(id), name, closed(fields, binaries));
}
SaidAnswer sayAnswer(const std::string& id, const ByteSlice& answer) {
    const Expected<ApplicationAnswer> read = decodeAnswer(answer);
    if (!read) return {errorText(id, {read.error().code, read.error().message}), {}};
    SaidAnswer said;
    const SaidJson json = answerJson(*read, said.binaries);
    said.text = answerText(id, json.name, json.fields, said.binaries.size());
    return said;
}
std::size_t SaidAnswer::size() const {
    std::size_t bytes = text.size();
    for (const ByteSlice& binary : binaries) bytes += binary.size();
    return bytes;
}
std::string errorText(const std::string& id, const ApiError& error) {
    return opened(id) + "\"error\":" + jsonText(errorJson(error)) + "}";
}
std::string noticeText(std::string_view name, const Json& fields, std::size_t binaries) {
    return fmt::format("{{\"notice\":\"{}\",{}", name, closed(fields, binaries));
}
std::string changesText(Sequence sequence, const ChangeList& list, bool whole) {
    if (whole || list.changeCount() > kMaxListedChanges)
        return fmt::format("{{\"changes\":{{\"sequence\":{},\"whole\":true}}}}", sequence.value);
    return fmt::format("{{\"changes\":{{\"sequence\":{},\"list\":{}}}}}", sequence.value, jsonText(changesJson(list)));
}

}  // namespace tessera
