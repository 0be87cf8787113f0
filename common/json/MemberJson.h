/// Whatever is described (common/request/Description.h) as JSON and back: an object with a key for each member. Heavy:
/// for the .cpp files of this folder.
#pragma once

#include <string_view>
#include <vector>

#include "common/json/JsonValues.h"
#include "common/request/Description.h"

namespace tessera {

/// Bytes go beside the text as binaries; lists of changes are written out.
[[nodiscard]] Json memberJson(const Description& of, const void* value, Binaries& binaries);

/// What a request's JSON may speak of beside itself, and what came of it beside its members.
struct JsonSurroundings {
    std::span<const ByteSlice> binaries;
    NamedObject named;
    std::vector<Blob> arrays;  ///< of lists of changes in it: they go before the request
};

class MemberJsonReader {
public:
    explicit MemberJsonReader(JsonSurroundings& around) : around_(around) {}

    [[nodiscard]] const std::optional<ApiError>& fault() const { return place_.fault(); }

    /// What is not said stays as it is. A key that is no member is refused, and named.
    void take(const Description& of, void* value, const Json& json);
    /// The bounds of the description.
    void check(const Description& of, const void* value);

private:
    void noSuchMember(const Description& of, const std::string& key);
    /// Members that may only be said in some cases.
    void refuseUncalledFor(const Description& of, const void* value, const Json& json);
    bool takeMember(const Description& of, void* value, const std::string& key, const Json& json);
    void takeValue(const MemberEntry& m, void* member, const Json& json, bool second);
    void takeMany(const MemberEntry& m, void* values, const Json& json);
    void takeOne(const MemberEntry& m, const ValueType& type, void* value, const Json& json);
    void takeInteger(const MemberEntry& m, const ValueType& type, void* value, const Json& json);
    void takeWord(const ValueType& type, void* value, const Json& json);
    void takeRow(const MemberEntry& m, const ValueType& type, void* value, const Json& json);
    void takeBytes(const MemberEntry& m, ByteSlice& value, const Json& json);

    JsonSurroundings& around_;
    JsonPlace place_;
};

}  // namespace tessera
