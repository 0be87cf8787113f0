#include "server/import/reader/VolumeFiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "server/import/reader/VolumeVoxels.h"

namespace tessera {
namespace {

constexpr std::size_t kMostHeaderLines = 256;

tl::unexpected<Error> packedVolume(std::string why) {
    return fail(ErrorCode::kUnsupported, std::move(why));
}

std::string lowerCased(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    return out;
}

std::string_view withoutSpaces(std::string_view text) {
    const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && space(text.front())) text.remove_prefix(1);
    while (!text.empty() && space(text.back())) text.remove_suffix(1);
    return text;
}

std::string printable(std::string_view text) {
    std::string out(text.substr(0, 60));
    for (char& c : out)
        if (c < 32 || c > 126) c = '?';
    return out;
}

std::vector<std::string_view> wordsOf(std::string_view text) {
    std::vector<std::string_view> words;
    while (!(text = withoutSpaces(text)).empty()) {
        const std::size_t end = std::min(text.find_first_of(" \t\r"), text.size());
        words.push_back(text.substr(0, end));
        text.remove_prefix(end);
    }
    return words;
}

std::optional<double> numberOf(std::string_view word) {
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number)) return std::nullopt;
    return number;
}
std::optional<std::size_t> countOf(std::string_view word) {
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return number;
}

/// Lines of a header, then bytes.
class HeaderText {
public:
    explicit HeaderText(ByteSpan bytes) : bytes_(bytes) {}
    [[nodiscard]] bool ended() const { return at_ >= bytes_.size() || lines_ >= kMostHeaderLines; }
    std::string_view line() {
        const auto* begin = reinterpret_cast<const char*>(bytes_.data()) + at_;
        const std::size_t left = bytes_.size() - at_, length = std::min(left, std::string_view(begin, left).find('\n'));
        at_ += std::min(left, length + 1);
        ++lines_;
        return withoutSpaces(std::string_view(begin, length));
    }
    [[nodiscard]] ByteSpan rest() const { return bytes_.subspan(at_); }

private:
    ByteSpan bytes_;
    std::size_t at_ = 0, lines_ = 0;
};

Expected<VolumeData> volumeFromText(const VolumeHeader& header, ByteSpan text) {
    std::vector<float> numbers;
    numbers.reserve(std::min(header.count(), text.size() / 2 + 1));
    std::string_view left(reinterpret_cast<const char*>(text.data()), text.size());
    while (numbers.size() < header.count()) {
        const std::size_t begin = left.find_first_not_of(" \t\r\n");
        if (begin == std::string_view::npos)
            return badVolumeFile(
                fmt::format("it ends too early: {} of {} numbers are there", numbers.size(), header.count()));
        left.remove_prefix(begin);
        const std::string_view word = left.substr(0, left.find_first_of(" \t\r\n"));
        const std::optional<double> number = numberOf(word);
        if (!number || std::abs(*number) > 1e30)
            return badVolumeFile(fmt::format("number {} is '{}', which is none", numbers.size(), printable(word)));
        numbers.push_back(static_cast<float>(*number));
        left.remove_prefix(word.size());
    }
    VolumeHeader floats = header;
    floats.number = FileNumber::kF32;
    floats.bigEndian = false;
    return volumeFrom(floats, std::as_bytes(std::span<const float>(numbers)));
}

template <typename T, typename Parse>
bool readThree(std::string_view text, T& out, Parse&& parse) {
    const std::vector<std::string_view> words = wordsOf(text);
    if (words.size() != 3) return false;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto number = parse(words[i]);
        if (!number) return false;
        out[static_cast<decltype(std::declval<T&>().size())>(i)] = *number;
    }
    return true;
}

/// What a file names stands beside it, wherever the scene is.
std::string besideOf(const std::string& name, const std::string& data) {
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos || data.front() == '/' ? data : name.substr(0, slash + 1) + data;
}

std::optional<FileNumber> numberNamed(std::string_view name,
                                      std::initializer_list<std::pair<std::string_view, FileNumber>> names) {
    for (const auto& [known, number] : names)
        if (known == name) return number;
    return std::nullopt;
}

// ---- MetaImage (itk.org, "MetaIO") ----------------------------------------------------------------------------------

Expected<VolumeData> readMetaImage(const FolderFiles& files, const std::string& name, ByteSpan bytes) {
    HeaderText text(bytes);
    VolumeHeader header;
    std::map<std::string, std::string> said;
    std::vector<std::string> notes;
    while (!text.ended() && !said.contains("elementdatafile")) {
        const std::string_view line = text.line();
        const std::size_t equals = line.find('=');
        if (line.empty() || equals == std::string_view::npos) continue;
        said[lowerCased(withoutSpaces(line.substr(0, equals)))] = std::string(withoutSpaces(line.substr(equals + 1)));
    }
    const auto of = [&](const char* key) {
        return said.contains(key) ? std::string_view(said[key]) : std::string_view();
    };
    const auto isTrue = [&](const char* key) { return lowerCased(of(key)) == "true"; };
    if (of("elementdatafile").empty())
        return badVolumeFile("a MetaImage says where its data are (ElementDataFile), this one does not");
    if (said.contains("ndims") && of("ndims") != "3")
        return packedVolume(fmt::format("it has {} dimensions: three are read", printable(of("ndims"))));
    if (isTrue("compresseddata")) return packedVolume("its data are compressed: only plain data are read");
    if (said.contains("binarydata") && !isTrue("binarydata"))
        return packedVolume("its data are numbers as text: bytes are read");
    if (said.contains("elementnumberofchannels") && of("elementnumberofchannels") != "1")
        return packedVolume("it has several numbers a voxel: one is read");
    if (!readThree(of("dimsize"), header.size, countOf))
        return badVolumeFile(fmt::format("DimSize is '{}': three whole numbers are wanted", printable(of("dimsize"))));
    for (const char* key : {"elementsize", "elementspacing"})  // the spacing where both are there
        if (said.contains(key) && !readThree(of(key), header.spacing, numberOf))
            return badVolumeFile(fmt::format("{} is '{}': three numbers are wanted", key, printable(of(key))));
    for (const char* key : {"origin", "position", "offset"})
        if (said.contains(key) && !readThree(of(key), header.origin, numberOf))
            return badVolumeFile(fmt::format("{} is '{}': three numbers are wanted", key, printable(of(key))));
    const std::optional<FileNumber> number =
        numberNamed(lowerCased(of("elementtype")), {{"met_uchar", FileNumber::kU8},
                                                    {"met_char", FileNumber::kI8},
                                                    {"met_ushort", FileNumber::kU16},
                                                    {"met_short", FileNumber::kI16},
                                                    {"met_uint", FileNumber::kU32},
                                                    {"met_int", FileNumber::kI32},
                                                    {"met_float", FileNumber::kF32},
                                                    {"met_double", FileNumber::kF64}});
    if (!number) return packedVolume(fmt::format("its ElementType '{}' is not read", printable(of("elementtype"))));
    header.number = *number;
    header.bigEndian = isTrue("elementbyteordermsb") || isTrue("binarydatabyteordermsb");
    if (said.contains("transformmatrix") && wordsOf(of("transformmatrix")) != wordsOf("1 0 0 0 1 0 0 0 1"))
        notes.push_back("its TransformMatrix turns it, which is left out");
    if (Expected<void> good = checkVolumeHeader(header); !good) return tl::unexpected(good.error());
    const std::string data = said["elementdatafile"];
    if (lowerCased(data) == "list" || data.find('%') != std::string::npos)
        return packedVolume("its data are a list of files: one file is read");
    Bytes own;
    ByteSpan numbers = text.rest();
    if (lowerCased(data) != "local") {
        Expected<Bytes> read = files.read(besideOf(name, data));
        if (!read) return failWith(fmt::format("'{}'", printable(data)), read.error());
        own = std::move(*read);
        numbers = own;
    }
    if (said.contains("headersize")) {
        const std::optional<double> skip = numberOf(of("headersize"));
        const std::size_t wanted = header.count() * bytesOfNumber(header.number);
        if (!skip || *skip < -1 || *skip > static_cast<double>(numbers.size()))
            return badVolumeFile(fmt::format("HeaderSize is '{}'", printable(of("headersize"))));
        numbers = *skip >= 0                 ? numbers.subspan(static_cast<std::size_t>(*skip))
                  : numbers.size() >= wanted ? numbers.subspan(numbers.size() - wanted)
                                             : numbers;
    }
    Expected<VolumeData> volume = volumeFrom(header, numbers);
    if (volume) volume->notes.insert(volume->notes.end(), notes.begin(), notes.end());
    return volume;
}

// ---- VolVis ---------------------------------------------------------------------------------------------------------

/// Runs as in the format: the low seven bits say how many, the high one that they follow each by itself; 0 ends a
/// slice.
bool unpackSlice(ByteSpan packed, std::byte* to, std::size_t size) {
    std::size_t at = 0, done = 0;
    while (at < packed.size()) {
        const auto head = std::to_integer<unsigned>(packed[at++]);
        const std::size_t count = head & 127u;
        if (count == 0) break;
        const bool each = (head & 128u) != 0;
        if (count > size - done || at + (each ? count : 1) > packed.size()) return false;
        if (each)
            std::copy_n(packed.data() + at, count, to + done);
        else
            std::fill_n(to + done, count, packed[at]);
        at += each ? count : 1;
        done += count;
    }
    return done == size;
}

Expected<VolumeData> readSlc(ByteSpan bytes) {
    std::size_t at = 0;
    const auto character = [&](std::size_t i) { return i < bytes.size() ? static_cast<char>(bytes[i]) : '\0'; };
    const auto isSpace = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
    // A number in text, and one character behind it that is none of its digits.
    const auto word = [&]() -> std::string_view {
        while (at < bytes.size() && isSpace(character(at))) ++at;
        const std::size_t begin = at;
        while (at < bytes.size() && at - begin < 32 && !isSpace(character(at)) && character(at) != 'X') ++at;
        return {reinterpret_cast<const char*>(bytes.data()) + begin, at - begin};
    };
    const auto pastX = [&] {
        while (at < bytes.size() && isSpace(character(at))) ++at;
        return character(at++) == 'X';
    };
    if (word() != "11111") return badVolumeFile("a VolVis file begins with 11111, this one does not");
    VolumeHeader header;
    std::array<std::optional<std::size_t>, 4> sizes;
    for (auto& size : sizes) size = countOf(word());
    std::array<std::optional<double>, 3> spacing;
    for (auto& step : spacing) step = numberOf(word());
    std::array<std::optional<std::size_t>, 6>
        more;  // unit, origin, modification, packing, width and height of a small picture
    for (auto& number : more) number = countOf(word());
    for (const auto& number : sizes)
        if (!number) return badVolumeFile("its header does not say how many voxels there are");
    for (const auto& number : spacing)
        if (!number) return badVolumeFile("its header does not say how far apart voxels are");
    for (const auto& number : more)
        if (!number) return badVolumeFile("its header ends too early");
    if (*sizes[3] != 8) return packedVolume(fmt::format("it has {} bits a voxel: 8 are read", *sizes[3]));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        header.size[axis] = *sizes[axis];
        header.spacing[static_cast<Eigen::Index>(axis)] = *spacing[axis];
    }
    if (Expected<void> good = checkVolumeHeader(header); !good) return tl::unexpected(good.error());
    if (!pastX()) return badVolumeFile("its header does not end with X");
    if (*more[4] > 65536 || *more[5] > 65536 || 3 * *more[4] * *more[5] > bytes.size() - std::min(at, bytes.size()))
        return badVolumeFile("it ends within its small picture");
    at += 3 * *more[4] * *more[5];
    if (*more[3] == 0) return volumeFrom(header, bytes.subspan(at));
    if (*more[3] != 1) return packedVolume(fmt::format("its packing {} is not read", *more[3]));
    const std::size_t slice = header.size[0] * header.size[1];
    Bytes voxels(slice * header.size[2]);
    for (std::size_t z = 0; z < header.size[2]; ++z) {
        const std::optional<std::size_t> packed = countOf(word());
        if (!packed || !pastX() || *packed > bytes.size() - std::min(at, bytes.size()))
            return badVolumeFile(fmt::format("it ends before slice {} of {}", z, header.size[2]));
        if (!unpackSlice(bytes.subspan(at, *packed), voxels.data() + z * slice, slice))
            return badVolumeFile(fmt::format("the runs of slice {} are not its {} voxels", z, slice));
        at += *packed;
    }
    return volumeFrom(header, voxels);
}

// ---- VTK, legacy ("VTK File Formats") -------------------------------------------------------------------------------

Expected<VolumeData> readLegacyVtk(ByteSpan bytes) {
    HeaderText text(bytes);
    if (!text.line().starts_with("# vtk DataFile Version"))
        return badVolumeFile("a legacy VTK file begins with '# vtk DataFile Version', this one does not");
    (void)text.line();  // its title
    VolumeHeader header;
    header.bigEndian = true;
    std::optional<bool> binary;
    bool structured = false, sized = false, ofPoints = false;
    while (!text.ended()) {
        const std::string_view line = text.line();
        const std::vector<std::string_view> words = wordsOf(line);
        if (words.empty()) continue;
        const std::string key = lowerCased(words[0]);
        const std::string_view values =
            withoutSpaces(line.substr(static_cast<std::size_t>(words[0].data() - line.data()) + words[0].size()));
        if (key == "binary" || key == "ascii")
            binary = key == "binary";
        else if (key == "dataset") {
            structured = lowerCased(values) == "structured_points";
            if (!structured)
                return packedVolume(
                    fmt::format("its data set '{}' is not read: STRUCTURED_POINTS is", printable(values)));
        } else if (key == "dimensions") {
            sized = readThree(values, header.size, countOf);
            if (!sized)
                return badVolumeFile(
                    fmt::format("DIMENSIONS is '{}': three whole numbers are wanted", printable(values)));
        } else if (key == "spacing" || key == "aspect_ratio") {
            if (!readThree(values, header.spacing, numberOf))
                return badVolumeFile(fmt::format("SPACING is '{}': three numbers are wanted", printable(values)));
        } else if (key == "origin") {
            if (!readThree(values, header.origin, numberOf))
                return badVolumeFile(fmt::format("ORIGIN is '{}': three numbers are wanted", printable(values)));
        } else if (key == "point_data") {
            ofPoints = sized && words.size() == 2 && countOf(words[1]) == header.count();
            if (!ofPoints) return badVolumeFile("POINT_DATA are not as many as DIMENSIONS says");
        } else if (key == "cell_data") {
            return packedVolume("its numbers belong to cells: those of points are read");
        } else if (key == "scalars") {
            if (!structured || !ofPoints || !binary)
                return badVolumeFile("SCALARS come before DATASET, DIMENSIONS or POINT_DATA");
            if (words.size() < 3 || (words.size() > 3 && words[3] != "1"))
                return packedVolume("it has several numbers a voxel: one is read");
            const std::optional<FileNumber> number =
                numberNamed(lowerCased(words[2]), {{"unsigned_char", FileNumber::kU8},
                                                   {"char", FileNumber::kI8},
                                                   {"unsigned_short", FileNumber::kU16},
                                                   {"short", FileNumber::kI16},
                                                   {"unsigned_int", FileNumber::kU32},
                                                   {"int", FileNumber::kI32},
                                                   {"float", FileNumber::kF32},
                                                   {"double", FileNumber::kF64}});
            if (!number) return packedVolume(fmt::format("its numbers '{}' are not read", printable(words[2])));
            header.number = *number;
            if (Expected<void> good = checkVolumeHeader(header); !good) return tl::unexpected(good.error());
            HeaderText behind = text;
            if (lowerCased(behind.line()).starts_with("lookup_table")) text = behind;
            return *binary ? volumeFrom(header, text.rest()) : volumeFromText(header, text.rest());
        } else {
            return packedVolume(
                fmt::format("it has '{}', which is not read: structured points with SCALARS are", printable(words[0])));
        }
    }
    return badVolumeFile("it ends before its SCALARS");
}

// ---- NRRD (teem.sourceforge.net/nrrd) -------------------------------------------------------------------------------

Expected<VolumeData> readNrrd(const FolderFiles& files, const std::string& name, ByteSpan bytes) {
    HeaderText text(bytes);
    if (!text.line().starts_with("NRRD000"))
        return badVolumeFile("an NRRD file begins with NRRD000, this one does not");
    std::map<std::string, std::string> said;
    while (!text.ended()) {
        const std::string_view line = text.line();
        if (line.empty()) break;
        const std::size_t colon = line.find(':');
        if (line.front() == '#' || colon == std::string_view::npos || line.substr(colon).starts_with(":=")) continue;
        std::string key = lowerCased(withoutSpaces(line.substr(0, colon)));
        std::erase(key, ' ');
        said[key] = std::string(withoutSpaces(line.substr(colon + 1)));
    }
    const auto of = [&](const char* key) {
        return said.contains(key) ? std::string_view(said[key]) : std::string_view();
    };
    VolumeHeader header;
    if (of("dimension") != "3")
        return packedVolume(fmt::format("it has '{}' dimensions: three are read", printable(of("dimension"))));
    if (!readThree(of("sizes"), header.size, countOf))
        return badVolumeFile(fmt::format("sizes is '{}': three whole numbers are wanted", printable(of("sizes"))));
    if (said.contains("spacings") && !readThree(of("spacings"), header.spacing, numberOf))
        return badVolumeFile(fmt::format("spacings is '{}': three numbers are wanted", printable(of("spacings"))));
    const std::optional<FileNumber> number = numberNamed(
        lowerCased(of("type")),
        {{"uchar", FileNumber::kU8},         {"unsigned char", FileNumber::kU8}, {"uint8", FileNumber::kU8},
         {"uint8_t", FileNumber::kU8},       {"signed char", FileNumber::kI8},   {"int8", FileNumber::kI8},
         {"int8_t", FileNumber::kI8},        {"ushort", FileNumber::kU16},       {"unsigned short", FileNumber::kU16},
         {"uint16", FileNumber::kU16},       {"uint16_t", FileNumber::kU16},     {"short", FileNumber::kI16},
         {"int16", FileNumber::kI16},        {"int16_t", FileNumber::kI16},      {"uint", FileNumber::kU32},
         {"unsigned int", FileNumber::kU32}, {"uint32", FileNumber::kU32},       {"uint32_t", FileNumber::kU32},
         {"int", FileNumber::kI32},          {"int32", FileNumber::kI32},        {"int32_t", FileNumber::kI32},
         {"float", FileNumber::kF32},        {"double", FileNumber::kF64}});
    if (!number) return packedVolume(fmt::format("its type '{}' is not read", printable(of("type"))));
    header.number = *number;
    header.bigEndian = lowerCased(of("endian")) == "big";
    if (Expected<void> good = checkVolumeHeader(header); !good) return tl::unexpected(good.error());
    const std::string encoding = lowerCased(of("encoding"));
    const bool isText = encoding == "text" || encoding == "txt" || encoding == "ascii";
    if (!isText && encoding != "raw")
        return packedVolume(fmt::format("its encoding '{}' is not read: raw and text are", printable(encoding)));
    if (said.contains("lineskip") || said.contains("byteskip"))
        return packedVolume("it skips a part of its data, which is not read");
    Bytes own;
    ByteSpan numbers = text.rest();
    const std::string data(said.contains("datafile") ? of("datafile") : "");
    if (!data.empty()) {
        if (lowerCased(data).starts_with("list") || data.find('%') != std::string::npos)
            return packedVolume("its data are a list of files: one file is read");
        Expected<Bytes> read = files.read(besideOf(name, data));
        if (!read) return failWith(fmt::format("'{}'", printable(data)), read.error());
        own = std::move(*read);
        numbers = own;
    }
    Expected<VolumeData> volume = isText ? volumeFromText(header, numbers) : volumeFrom(header, numbers);
    if (volume && (said.contains("spacedirections") || said.contains("spaceorigin")))
        volume->notes.push_back("its space directions and origin are left out");
    return volume;
}

std::string extensionIn(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    return dot == std::string::npos ? std::string() : lowerCased(std::string_view(name).substr(dot + 1));
}

}  // namespace

std::span<const std::string_view> volumeEndings() {
    static constexpr std::array<std::string_view, 6> kEndings = {"mhd", "mha", "slc", "vtk", "nrrd", "nhdr"};
    return kEndings;
}
bool isVolumeFile(std::string_view extension) {
    return std::ranges::find(volumeEndings(), extension) != volumeEndings().end();
}

Expected<VolumeData> readVolumeFile(const FolderFiles& files, const std::string& name) {
    const std::string extension = extensionIn(name);
    if (!isVolumeFile(extension))
        return fail(ErrorCode::kUnsupported, "no volume: .mhd, .mha, .slc, .vtk, .nrrd and .nhdr are read");
    const Expected<Bytes> bytes = files.read(name);
    if (!bytes) return tl::unexpected(bytes.error());
    if (extension == "slc") return readSlc(*bytes);
    if (extension == "vtk") return readLegacyVtk(*bytes);
    return extension.front() == 'n' ? readNrrd(files, name, *bytes) : readMetaImage(files, name, *bytes);
}

}  // namespace tessera
