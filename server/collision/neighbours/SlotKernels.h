/// The inner loops of neighbour finding, compiled for each instruction set. Plain data only: what is shared with other
/// translation units must not be compiled with wider instructions than the processor may have.
///
/// **Keys.** A box is worked on as six floats, its bounds less an origin, each rounded to the nearest float. Rounding is
/// monotone, so of two bounds in double x ≤ y the keys are in that order too, and keys x < y say that the bounds are in
/// that order: only equal keys leave a question, which the caller answers in double. Keys are clamped to ±kFar (monotone
/// as well), so that differences are finite; an empty box has its lower keys at kNowhere and its upper ones at −kNowhere.
///
/// **Slots.** Boxes are kept in an order in which neighbours in space lie side by side (`cells` of a grid, leaves of a
/// tree), one array per bound, with the keys of now (`cur`) and of the frame before (`prev`). What the kernels find is
/// *differences*: pairs that met then and do not now, or the other way about. With nothing in `prev`, that is all pairs.
/// All arrays may be read up to kSlotPadding slots beyond their end.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::neighbours {

constexpr float kFar = 1e38F;
constexpr float kNowhere = 3e38F;
constexpr std::size_t kSlotPadding = 32;
constexpr std::size_t kLeafSlots = 16;  ///< slots in a leaf, children of a node

/// Two slots whose boxes (surely, or perhaps) met then and do not now, or the other way about.
struct SlotPair {
    static constexpr std::uint32_t kUnsure = 1U << 31;  ///< equal keys: to be decided in double
    static constexpr std::uint32_t kBegins = 1U << 30;
    static constexpr std::uint32_t kSlotMask = kBegins - 1;
    std::uint32_t first;
    std::uint32_t secondAndFlags;
};

/// Where a kernel puts its pairs. One that finds no room stops and says how far it came.
struct PairSink {
    SlotPair* out;
    std::size_t capacity;
    std::size_t count;
    std::uint64_t steps;  ///< vectors of candidates that were looked at: the same on one machine for any number of threads
};

struct SlotArrays {
    const float* cur[6];  ///< lower x, y, z, upper x, y, z
    const float* prev[6];
};

/// Cells over the lower corners, as they were when the slots were put in order: cell of v along an axis = (v - origin) *
/// scale, clamped to 0 … last. The first axis is the one along which cells lie side by side; a column is a row of them.
struct CellFrame {
    float origin[3];
    float scale[3];
    float last[3];
    std::uint32_t xBits;  ///< log2 of the cells in a column
    std::uint32_t ny;     ///< columns lie side by side along the second axis
};

struct GridView {
    SlotArrays slots;
    CellFrame frame;
    const std::uint32_t* cell;   ///< per slot of the grid: column << xBits | cell in the column; ascending
    const std::uint32_t* start;  ///< first slot of each cell; at the end the number of slots in the grid
    std::uint32_t looseBegin;    ///< slots outside of all cells: outsized boxes, and what leapt
    std::uint32_t looseEnd;
    float reach[3];  ///< how far below a box the cell of a box that meets it may be: extent and drift
    float drift[3];  ///< how far above
};

/// Boxes (of now and before) around 16 slots each, around 16 of these each, and so on up to one.
struct TreeView {
    static constexpr int kMaxLevels = 8;
    SlotArrays slots;
    std::uint32_t slotCount;
    int levels;
    float* box[kMaxLevels][6];         ///< per level, from the leaves up
    std::uint32_t nodes[kMaxLevels];
};

/// What has happened to slots since they were put in order.
struct Settlement {
    float maxDrift[3];   ///< in: what a slot may drift to stay; out: how far those that stay have drifted
    float maxExtent[3];  ///< in: how large a box may be to stay
};

struct SlotKernels {
    /// Keys of n boxes (six doubles each) into records of 8 floats (lower, 0, upper, 0); record slotOf[i], none for ~0.
    /// `copy`, where not null, gets the doubles.
    void (*convert)(const double* boxes, double* copy, const std::uint32_t* slotOf, std::size_t n, const double origin[3],
                    float* records);
    /// Records to arrays, for slots begin (a multiple of 16) up to end.
    void (*spread)(const float* records, std::size_t begin, std::size_t end, float* const arrays[6]);
    /// Lists the slots that do not stay, and says how many.
    std::size_t (*settle)(const float* const cur[6], const float* const placed[3], std::size_t begin, std::size_t end,
                          Settlement& settlement, std::uint32_t* leavers);
    void (*cells)(const CellFrame& frame, const float* const lower[3], std::size_t n, std::uint32_t* cell);

    /// Each pair of grid slots once, for the first slots begin … end - 1. Returns how far it came.
    std::size_t (*gridAll)(const GridView& grid, std::size_t begin, std::size_t end, PairSink& sink);
    /// Each of the listed slots against the whole grid and, where `loose`, against all loose slots, else against the loose
    /// ones after it. May report a slot with itself.
    std::size_t (*gridSome)(const GridView& grid, const std::uint32_t* slots, std::size_t begin, std::size_t end, bool loose,
                            PairSink& sink);

    void (*treeLeaves)(const TreeView& tree, std::size_t begin, std::size_t end);
    void (*treeUpper)(const TreeView& tree);
    /// Each pair of slots once, for the first slot in leaves begin … end - 1.
    std::size_t (*treeAll)(const TreeView& tree, std::size_t begin, std::size_t end, PairSink& sink);
    /// Each of the listed slots against all. May report a slot with itself.
    std::size_t (*treeSome)(const TreeView& tree, const std::uint32_t* slots, std::size_t begin, std::size_t end,
                            PairSink& sink);
};

/// Those for this processor.
[[nodiscard]] const SlotKernels& slotKernels();

}  // namespace tessera::neighbours
