/// What a stranger says to the console: the head of a request, a message on a socket, the fields of a request.
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <nlohmann/json.hpp>

#include "common/codec/ApplicationCodec.h"
#include "common/json/RequestJson.h"
#include "common/request/Catalogue.h"
#include "server/door/Envelope.h"
#include "server/door/Gatekeeper.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

namespace http = boost::beast::http;

void head(std::string_view text) {
    http::request_parser<http::string_body> parser;
    parser.header_limit(16 << 10);
    parser.body_limit(1 << 20);
    parser.eager(true);
    boost::beast::error_code error;
    parser.put(boost::asio::buffer(text), error);
    if (error || !parser.is_header_done()) return;
    const auto& said = parser.get();
    const auto field = [&](http::field name) { return std::string(said[name]); };
    (void)boost::beast::websocket::is_upgrade(said);
    const HttpRequest request{.method = std::string(said.method_string()),
                              .target = std::string(said.target()),
                              .host = field(http::field::host),
                              .origin = field(http::field::origin),
                              .authorization = field(http::field::authorization)};
    const std::optional<HttpTarget> target = readTarget(request.target);
    if (!target) return;
    must(!Gatekeeper(AccessTokens::fresh(), 7001).entrantOf(request, *target), "nobody comes in without the token");
}

void ask(std::string_view name, const Json& fields, std::span<const ByteSlice> binaries) {
    ObjectNames names;
    const ApiExpected<ReadRequest> read = readRequest(name, fields, binaries, names);
    if (!read) return must(!read.error().message.empty(), "an error has words");
    // What the door sends the server takes: it passes the same bounds there. A list alone may be refused for what the
    // scene says.
    must(decodeRequest(share(encodeRequest(read->request))).has_value(), "what was read can be sent");
}

void run(FuzzInput in) {
    const auto what = in.number<std::uint8_t>();
    const auto which = in.number<std::uint8_t>();
    const ByteSpan rest = in.rest();
    const std::string_view text(reinterpret_cast<const char*>(rest.data()), rest.size());
    const std::vector<ByteSlice> binaries{ByteSlice(Bytes(24, std::byte{1})), ByteSlice(Bytes(which, std::byte{2}))};
    if (what % 3 == 0) return head(text);
    if (what % 3 == 1) {
        const auto [envelope, id] = readEnvelope(text);
        must(parseJson(errorText(id, {ErrorCode::kFailed, "x"})).has_value(), "an answer is JSON whatever the id was");
        const Json nothing;
        if (envelope) ask(envelope->request, envelope->fields ? *envelope->fields : nothing, binaries);
        return;
    }
    const ApiExpected<Json> fields = parseJson(text);
    if (fields) ask(allRequests()[which % allRequests().size()].info.name, *fields, binaries);
}

}  // namespace
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
