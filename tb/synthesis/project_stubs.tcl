# SPDX-License-Identifier: Apache-2.0
# Stubs of the commands by which projects are made and built: Vivado (UG835), Quartus (its scripting reference),
# Radiant, Diamond and Gowin EDA (their guides to Tcl). The first argument is the tool, the others are its scripts. Each
# command prints itself with its arguments, a tab between, and refuses an option, a name or a file that is not there; a
# command that the tool has not is unknown.

proc say {args} { puts "CALL\t[join $args \t]" }

# Arguments without the options, which are flags or take a value; refuses others.
proc take {command options flags least most arguments} {
  set others {}
  for {set i 0} {$i < [llength $arguments]} {incr i} {
    set word [lindex $arguments $i]
    if {$word in $flags} { continue }
    if {$word in $options} {
      incr i
    } elseif {[regexp {^-[a-z]} $word]} {
      error "$command has no option $word"
    } else {
      lappend others $word
    }
  }
  if {[llength $others] < $least || [llength $others] > $most} {
    error "$command takes $least to $most arguments: $arguments"
  }
  say $command {*}$arguments
  return $others
}

proc option {name arguments} { return [lindex $arguments [expr {[lsearch -exact $arguments $name] + 1}]] }

proc need_file {file} {
  if {![file exists $file]} { error "no file $file" }
}

# Commands by name, options, flags, least and most of the other arguments.
proc known {table} {
  foreach {name options flags least most} $table {
    proc $name args [list apply {{name options flags least most} {
      upvar args args
      take $name $options $flags $least $most $args
    }} $name $options $flags $least $most]
  }
}

set argv [lassign $argv tool]
switch $tool {
  vivado {
    known {
      create_project {-part} {-force -in_memory} 0 2 launch_runs {-jobs -to_step} {} 1 9 wait_on_run {} {} 1 1
      open_run {-name} {} 1 1 write_edif {} {-force} 1 1 write_verilog {-mode} {-force} 1 1 reset_runs {} {} 1 9
    }
    foreach name {current_project current_fileset get_runs get_filesets} {
      proc $name args [list apply {{name} { upvar args args; return $name:[lindex $args 0] }} $name]
    }
    proc get_property {name object} { return [expr {$name eq "PROGRESS" ? "0%" : 0}] }
    proc set_property args {
      if {[llength [take set_property {-name -value -objects} {} 0 3 $args]] ni {0 3}} { error "set_property $args" }
      set name [expr {[llength $args] == 3 ? [lindex $args 0] : [option -name $args]}]
      if {$name ni {part top source_mgmt_mode include_dirs {STEPS.SYNTH_DESIGN.ARGS.MORE OPTIONS}}} {
        error "no property $name"
      }
    }
    foreach {name flags} {read_vhdl -vhdl2008 read_xdc -unmanaged} {
      proc $name args [list apply {{name flags} {
        upvar args args
        need_file [lindex [take $name -library $flags 1 1 $args] 0]
      }} $name $flags]
    }
  }
  quartus {
    known {project_new {} {-overwrite} 1 1}
    proc set_global_assignment args {
      set value [lindex [take set_global_assignment {-name -library} {} 1 1 $args] 0]
      set name [option -name $args]
      if {$name in {VHDL_FILE SDC_FILE}} {
        need_file $value
      } elseif {$name ni {FAMILY DEVICE TOP_LEVEL_ENTITY}} {
        error "no assignment $name"
      }
    }
    proc set_instance_assignment args {
      take set_instance_assignment {-name -to} {} 1 1 $args
      if {[option -name $args] ne "VIRTUAL_PIN"} { error "no assignment of an instance: $args" }
    }
  }
  radiant {
    known {
      prj_create {-name -impl -dev -performance -synthesis} {} 0 0 prj_set_impl_opt {} {} 2 2 prj_save {} {} 0 0
      prj_close {} {} 0 0 prj_open {} {} 1 1 prj_run {-impl -task} {-forceOne} 1 1
    }
    proc prj_add_source args { need_file [lindex [take prj_add_source -work {} 1 1 $args] 0] }
  }
  diamond {
    proc prj_project {command args} {
      if {$command ni {new open save close}} { error "prj_project has no command $command" }
      take "prj_project $command" {-name -dev -lpf -synthesis -impl} {} 0 1 $args
    }
    proc prj_impl {command args} { take "prj_impl $command" {} {} 2 2 $args }
    proc prj_src {command args} { need_file [lindex [take "prj_src $command" {-work -format} {} 1 1 $args] 0] }
    known {prj_run {-impl -task} {} 1 1}
  }
  gowin {
    known {set_device {-name} {} 1 1 run {} {} 1 1}
    proc add_file args { need_file [lindex [take add_file -type {} 1 1 $args] 0] }
    proc set_option args { take set_option {-top_module -output_base_name -include_path -vhdl_std} {} 0 0 $args }
  }
  default { error "no tool $tool" }
}

rename exit leave
proc exit args {}
cd [file dirname [lindex $argv 0]]
foreach script $argv { source [file tail $script] }
