(** An accepted claim holds. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Claims Slopes Witness Laws Ranges Silent Roundings
    Relaxation Increments Cover Halves Among Laws_among Everywhere.
Import ListNotations.
Open Scope R_scope.

Theorem step_sound ps accepted c p : Forall (holds ps) accepted -> check_claim ps accepted c p = true -> holds ps c.
Proof.
  intros HA. destruct c, p; simpl check_claim; try discriminate; intros H.
  - exact (norm_above_sound _ _ _ _ _ H).
  - exact (norm_below_sound _ _ _ H).
  - now apply slope_sound in H.
  - now apply product_sound in H.
  - now apply slope_everywhere_sound in H.
  - now apply points_sound in H.
  - now apply local_product_sound in H.
  - now apply local_slope_sound in H.
  - now apply slope_in_box_sound in H.
  - now apply halves_sound in H.
  - now apply law_sound in H.
  - now apply law_in_box_sound in H.
  - now apply within_sound in H.
  - now apply sum_within_sound in H.
  - now apply jump_sound in H.
  - now apply error_sound in H.
  - now apply sum_error_sound in H.
  - now apply slope_among_sound in H.
  - now apply law_among_sound in H.
  - now apply step_at_most_sound in H.
Qed.
(** What the program does claim by claim. *)
Theorem accepted_hold ps accepted c p accepted' : Forall (holds ps) accepted -> step ps accepted c p = Some accepted' ->
  Forall (holds ps) accepted'.
Proof.
  intros H. unfold step. destruct (check_claim ps accepted c p) eqn:E; [|discriminate]. intros G. inversion G.
  constructor; auto. eapply step_sound; eauto.
Qed.
(** What the kernel does for all of them. *)
Theorem check_all_sound ps cs accepted : Forall (holds ps) accepted -> check_all ps accepted cs = true ->
  Forall (fun c => holds ps (fst c)) cs.
Proof.
  revert accepted. induction cs as [|[c p] cs IH]; intros accepted H G; [constructor|]. simpl in G.
      apply andb_prop in G.
  destruct G as [G1 G2]. pose proof (step_sound _ _ _ _ H G1) as S. constructor; auto. apply (IH (c :: accepted)); auto.
Qed.
Corollary check_all_holds ps cs : check_all ps [] cs = true -> Forall (fun c => holds ps (fst c)) cs.
Proof. apply check_all_sound. constructor. Qed.
