# Builds the page: cmake -DFROM= -DWORK= -DTO= -DNODE= -DNPM= -P build_page.cmake
# Its libraries are fetched once for each package-lock.json. Where they cannot be had, no network
# for one, the page is left out with a line, and the rest of the build goes on.
file(MAKE_DIRECTORY ${WORK})
set(kept node_modules lock.sha256)
file(GLOB old RELATIVE ${WORK} ${WORK}/*)
list(REMOVE_ITEM old ${kept})
foreach(name ${old})
  file(REMOVE_RECURSE ${WORK}/${name})
endforeach()
file(COPY ${FROM}/ DESTINATION ${WORK} PATTERN node_modules EXCLUDE PATTERN dist EXCLUDE)

file(SHA256 ${WORK}/package-lock.json lock)
set(fetched "")
if(EXISTS ${WORK}/lock.sha256)
  file(READ ${WORK}/lock.sha256 fetched)
endif()
if(NOT fetched STREQUAL lock)
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline --loglevel=error
    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE said TIMEOUT 300)
  if(failed)
    string(REGEX MATCH "[^\n]*" said "${said}")
    message("The page of scarp serve is left out: npm could not fetch its libraries (${said})")
    file(REMOVE_RECURSE ${TO})
    return()
  endif()
  file(WRITE ${WORK}/lock.sha256 ${lock})
endif()

execute_process(COMMAND ${CMAKE_COMMAND} -E env SCARP_PAGE_OUT=${TO}
    ${NODE} ${WORK}/node_modules/vite/bin/vite.js build --logLevel warn
  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed TIMEOUT 300)
if(failed)
  message(FATAL_ERROR "Vite could not build the page")
endif()
