#!/usr/bin/env perl
# Puts every broken margin of mutations.txt into a copy of the sources, to be chosen when the tests
# are run: mutate.pl CATALOGUE SOURCES writes SOURCES/core/... and prints a line for each:
#   number TAB expected (red, green or either) TAB margin TAB how
# A place that is not there once, because the code has changed, is named on stderr; exit 1.
#   mutate.pl --table RESULTS
# prints the table of docs/stability.md from such lines with one more field: the test that went red,
# or "green". Exit 1 where it is not what was expected.
use strict;
use warnings;
use utf8;
use open qw(:std :utf8);

# What came of it, a row for each margin.
sub print_table {
  my ($results) = @_;
  open(my $in, '<', $results) or die "mutate.pl: $results: $!\n";
  my (@margins, %of, $wrong);
  while (<$in>) {
    chomp;
    my ($number, $expected, $margin, $how, $test) = split /\t/;
    push @margins, $margin unless $of{$margin};
    $test =~ s/^(\w+)\.(\w+)/$1 =~ m{^(Wall|PieceTargets|ReachedCells)$} ? $1 : $2/e;
    my $unexpected = $expected eq 'red' && $test eq 'green' || $expected eq 'green' && $test ne 'green';
    $wrong ||= $unexpected;
    $how = "**$how**" if $unexpected;
    $how = "$how (stays right)" if $expected eq 'green';
    $how = "$how (not seen)" if $expected eq 'either' && $test eq 'green';
    push @{$of{$margin}{how}}, $how;
    $of{$margin}{test}{$test} = 1 if $test ne 'green';
  }
  print "| margin: how it was broken | red in |\n|---|---|\n";
  for my $margin (@margins) {
    my $tests = join(', ', sort keys %{$of{$margin}{test}}) || '-';
    print "| $margin: ", join('; ', @{$of{$margin}{how}}), " | $tests |\n";
  }
  exit($wrong ? 1 : 0);
}

print_table($ARGV[1]) if $ARGV[0] eq '--table';

my ($catalogue, $sources) = @ARGV;
my ($margin, $file, $place, $is_new, $number, $failed) = ('', '', undef, 0, 0, 0);
my %edits;    # file => [start, end, [[number, code]...]]
my (%text, @lines, @missed);

sub text_of {
  my ($name) = @_;
  return $text{$name} //= do {
    open(my $in, '<', "$sources/$name") or die "mutate.pl: $sources/$name: $!\n";
    local $/;
    <$in>;
  };
}

# Code as a pattern that does not mind how it is laid out.
sub pattern_of {
  my ($code) = @_;
  return join('\s*', map { quotemeta } grep { /\S/ } split(/\s+|(?<=\W)|(?=\W)/, $code));
}

sub find_place {
  my ($code, $line) = @_;
  my ($before, $part, $after) = $code =~ /^(.*?)«(.*?)»(.*)$/ or return undef;
  my $source = text_of($file);
  my ($b, $p, $a) = map { pattern_of($_) } $before, $part, $after;
  $b .= '\s*' if length $b;
  $a = '\s*' . $a if length $a;
  my @found;
  while ($source =~ /$b()$p()$a/g) { push @found, [$-[1], $-[2]]; pos($source) = $-[0] + 1; }
  if (@found != 1) {
    push @missed, "line $line: found " . @found . " times in $file: $code\n";
    return undef;
  }
  my ($start, $end) = @{$found[0]};
  $end-- while $end > $start && substr($source, $end - 1, 1) =~ /\s/;
  for my $edit (@{$edits{$file}}) {
    return $edit if $edit->[0] == $start && $edit->[1] == $end;
  }
  my $edit = [$start, $end, []];
  push @{$edits{$file}}, $edit;
  return $edit;
}

open(my $in, '<', $catalogue) or die "mutate.pl: $catalogue: $!\n";
while (my $line = <$in>) {
  chomp $line;
  next if $line =~ /^(#|\s*$)/;
  if ($line =~ /^margin (.*)/) { $margin = $1 }
  elsif ($line =~ /^@ (.*)/) { $file = $1 }
  elsif ($line =~ /^- (.*)/) { ($place, $is_new) = (undef, 1) unless $is_new; $place //= find_place($1, $.) }
  elsif ($line =~ /^([+=?]) (.*?) :: (.*)/) {
    ++$number;
    $failed = 1, print STDERR @missed if $is_new && !$place;
    ($is_new, @missed) = (0);
    next unless $place;
    push @{$place->[2]}, [$number, $2];
    push @lines, join("\t", $number, {'+' => 'red', '=' => 'green', '?' => 'either'}->{$1}, $margin, $3);
  }
  else { die "mutate.pl: line $.: not understood: $line\n" }
}

for my $name (keys %edits) {
  my $source = text_of($name);
  my $last = length $source;
  for my $edit (sort { $b->[0] <=> $a->[0] } @{$edits{$name}}) {
    my ($start, $end, $changes) = @$edit;
    next unless @$changes;
    die "mutate.pl: two places of $name overlap: ", substr($source, $start, $end - $start), "\n" if $end > $last;
    $last = $start;
    my $part = substr($source, $start, $end - $start);
    my $code = '';
    if ($part =~ /^\{(.*), (.*)\}$/) {    # a list in a loop: each of its two members
      my @members = ($1, $2);
      for my $change (reverse @$changes) {
        my @new = $change->[1] =~ /^\{(.*), (.*)\}$/ or die "mutate.pl: no list: $change->[1]\n";
        $members[$_] = "scarp_mutant == $change->[0] ? $new[$_] : $members[$_]" for 0, 1;
      }
      $code = "{$members[0], $members[1]}";
    } elsif ($part =~ /[;}]$/) {
      $code .= "if (scarp_mutant == $_->[0]) { $_->[1] } else " for @$changes;
      $code .= "{ $part }";
    } elsif ($part eq '') {
      $code = join('', map { my ($sign, $value) = $_->[1] =~ /^([+-]) (.*)$/; " $sign (scarp_mutant == $_->[0] ? $value : 0)" } @$changes);
    } else {
      $code .= "(scarp_mutant == $_->[0]) ? ($_->[1]) : " for @$changes;
      $code = "($code($part))";
    }
    substr($source, $start, $end - $start) = $code;
  }
  $source = "extern const int scarp_mutant;\n$source";
  $source =~ s/\A(extern[^\n]*\n)(.*?)#pragma once\n/#pragma once\n$1$2/s;
  open(my $out, '>', "$sources/$name") or die "mutate.pl: $sources/$name: $!\n";
  print $out $source;
}
open(my $out, '>', "$sources/core/mutant.cc") or die "mutate.pl: $!\n";
print $out <<'CODE';
#include <cstdlib>
extern const int scarp_mutant;
const int scarp_mutant = std::getenv("SCARP_MUTANT") ? std::atoi(std::getenv("SCARP_MUTANT")) : 0;
CODE
print "$_\n" for @lines;
exit $failed;
