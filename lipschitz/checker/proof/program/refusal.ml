(* Why a file is not read, and why a certificate is rejected. *)

exception Bad_input of string  (* exit 3 *)
exception Rejected of string  (* exit 1 *)

let bad_input format = Printf.ksprintf (fun text -> raise (Bad_input text)) format
let rejected format = Printf.ksprintf (fun text -> raise (Rejected text)) format
let require condition format =
  Printf.ksprintf (fun text -> if not condition then raise (Rejected text)) format

(* At most 64 MiB of certificate, and a gibibyte of anything. *)
let contents path =
  let file = try open_in_bin path with Sys_error reason -> bad_input "%s" reason in
  if Sys.is_directory path then bad_input "%s: is a folder; name a file in it" path;
  Fun.protect ~finally:(fun () -> close_in_noerr file) (fun () ->
    try
      let length = in_channel_length file in
      if length > 1 lsl 30 then bad_input "%s: is larger than 1 GiB" path;
      really_input_string file length
    with
    | Sys_error reason -> bad_input "%s: %s" path reason
    | End_of_file -> bad_input "%s: changed while it was read" path)

(* As many characters as are worth showing. *)
let shown text = if String.length text <= 60 then text else String.sub text 0 60 ^ "..."
