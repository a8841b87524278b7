#pragma once

#include <string>

namespace scarp {

/// Throws Error{kResource}: what could not be written, why (an errno), and what to do about it.
[[noreturn]] void throw_write_error(const std::string& path, int reason);

/// Throws Error{kInput} where the file cannot be had under its name, Error{kResource} where the
/// system fails (memory, descriptors, the disk).
[[noreturn]] void throw_read_error(const std::string& path, int reason);

/// Throws Error{kInput}: an output is there already and was not to be replaced.
[[noreturn]] void throw_exists(const std::string& path);

}  // namespace scarp
