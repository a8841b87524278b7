#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace scarp {

/// A stretch of GDAL work on one thread: drivers registered, no side files (.aux.xml), and GDAL's
/// messages kept for error(). Files are built in memory below folder() and removed at the end, so
/// that what reaches the disk is written by PartFile, which sees every failure: GDAL 3.6 reports
/// none of those that happen while it closes a file.
///
/// Requires that datasets opened within are closed before it ends.
class GdalSession {
 public:
  GdalSession();
  ~GdalSession();
  GdalSession(const GdalSession&) = delete;
  GdalSession& operator=(const GdalSession&) = delete;

  /// A folder in memory that nobody else has, such as "/vsimem/scarp-1234-abcd".
  const std::string& folder() const { return folder_; }

  /// Bytes of a file in memory; they live until it is changed or this session ends.
  /// Errors: kResource where there is none, which means that GDAL ran out of memory.
  std::span<const std::byte> bytes_of(const std::string& memory_path,
                                      const std::string& path) const;

  /// Throws Error{kResource} where GDAL has reported an error since the session began.
  void check(const std::string& path) const;

  /// Throws Error{kResource}: `path` could not be written, and GDAL's own words for it.
  [[noreturn]] void fail(const std::string& path) const;

 private:
  std::string folder_;
  std::string first_error_;
};

}  // namespace scarp
