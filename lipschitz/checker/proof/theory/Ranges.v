(** Accepted claims of values over boxes hold: intervals layer by layer, sums of terms, and jumps. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Float Meaning Steepness Sets Distance Blocks
    Lower Values Enclosures Intervals Centred Claims Slopes Witness Laws.
Import ListNotations.
Open Scope R_scope.

Lemma same_numbers_eq x y : same_numbers x y = true -> x = y.
Proof.
  revert y. induction x as [|a x IH]; intros [|b y]; simpl; auto; try discriminate. intros H. both H.
  apply same_eq in H. f_equal; auto.
Qed.
Lemma contains_within a b x : contains a b = true -> within b x -> within a x.
Proof.
  revert b x. induction a as [|[l h] a IH]; intros [|[l' h'] b] [|y x]; simpl; try tauto; try discriminate.
  intros H [G1 G2]. do 2 both H. apply at_most_real in H, H1. split; [lra|]. eauto.
Qed.
Lemma encloses_within w c b v x : encloses w c b v = true -> within b x -> within v (affine (realm w) (reals c) x).
Proof.
  revert c v. induction w as [|row w IH]; intros [|a c] [|[l h] v]; simpl; try discriminate; auto.
  intros H G. pose proof (row_ends_within row b x G) as E. destruct (row_ends row b) as [s t]. do 2 both H.
  apply at_most_real in H, H1. rewrite real_add in H, H1. simpl in E. split; [simpl; lra|]. now apply IH.
Qed.
Lemma layers_within hid last b bounds v x : check_layers hid last b bounds v = true -> within b x ->
  within v (network (relu_layers hid) (real_layer last) x).
Proof.
  revert b bounds x. induction hid as [|[w c] hid IH]; intros b [|v' bounds] x; simpl; try discriminate.
  - apply encloses_within.
  - intros H G. both H. eapply IH; eauto. apply relu_within. eapply encloses_within; eauto.
Qed.
Lemma within_sound ps p b bounds v : check_within ps p b bounds v = true -> holds ps (Within p b v).
Proof.
  unfold check_within. intros H x Hx. apply (within_clamped (clamp (part_at ps p))) in Hx. unfold value.
  destruct (relu_between (part_at ps p)) eqn:R; [rewrite relu_network by auto; eapply layers_within; eauto|].
  eapply centred_sound; eauto.
Qed.
Lemma find_within_sound ps accepted p b v : Forall (holds ps) accepted -> find_within accepted p b = Some v ->
  holds ps (Within p b v).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl find_within; auto.
  destruct (Nat.eqb_spec p p0); simpl; auto. destruct (same_box b b0) eqn:E; auto. apply same_box_eq in E.
  intros G. inversion G. subst. exact Hc.
Qed.

(** Sums *)
(** k times an interval: what k vectors in it sum up to. *)
Fixpoint times_within (k : R) (v : box) (x : list R) : Prop :=
  match v, x with
  | (l, h) :: v', a :: x' => k * real l <= a <= k * real h /\ times_within k v' x'
  | [], [] => True
  | _, _ => False
  end.
Lemma times_zero v : times_within 0 v (zeros (length v)).
Proof. induction v as [|[l h] v IH]; simpl; auto. split; [lra|exact IH]. Qed.
Lemma times_plus k v x y : within v x -> times_within k v y -> times_within (1 + k) v (plusR x y).
Proof.
  revert x y. induction v as [|[l h] v IH]; intros [|a x] [|b y]; simpl; try tauto. intros [H1 H2] [G1 G2].
  split; [lra|auto].
Qed.
Lemma length_plus u v : length u = length v -> length (plusR u v) = length v.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto. Qed.
Lemma sum_within v xs : Forall (within v) xs ->
  exists y, times_within (INR (length xs)) v y /\ length y = length v /\
    forall s, length s = length v -> plusR (vector_sum xs) s = plusR y s.
Proof.
  intros H. induction H as [|x xs Hx H (y & T & L & E)].
  - exists (zeros (length v)). split; [apply times_zero|]. split; [apply repeat_length|]. intros s Hs. simpl.
    rewrite <- Hs. unfold zeros. clear. induction s as [|a s IH]; simpl; auto. rewrite <- IH. f_equal. ring.
  - exists (plusR x y). split; [|split].
    + change (length (x :: xs)) with (S (length xs)). rewrite S_INR, Rplus_comm. now apply times_plus.
    + rewrite length_plus; auto. rewrite L. now apply within_length.
    + intros s Hs. simpl. rewrite !plus_assoc. rewrite (E s Hs). reflexivity.
Qed.
Lemma add_ends_within low high v s k y z : IZR low <= k <= IZR high -> times_within k v y -> within s z ->
  length v = length s -> within (add_ends low high v s) (plusR y z).
Proof.
  intros K. revert s y z. induction v as [|[l h] v IH]; intros [|[a b] s] [|c y] [|d z]; simpl; try tauto;
    try discriminate.
  intros [H1 H2] [G1 G2] L. split; [|apply IH; auto]. rewrite !real_add, !real_mul.
  assert (forall n, real (n, 0%Z) = IZR n) as R by (intros n; unfold real; simpl; ring).
  assert (forall x, is_nonnegative x = false -> real x <= 0) as N by (intros x E; now apply Rlt_le, negative_real).
  rewrite !R. split.
  - destruct (is_nonnegative l) eqn:E; [apply real_nonnegative in E|apply N in E]; nra.
  - destruct (is_nonnegative h) eqn:E; [apply real_nonnegative in E|apply N in E]; nra.
Qed.
Lemma vector_sum_app us vs : vector_sum (us ++ vs) = plusR (vector_sum us) (vector_sum vs).
Proof. induction us as [|u us IH]; simpl; auto. now rewrite IH, plus_assoc. Qed.
Lemma length_add_ends low high v s : length v = length s -> length (add_ends low high v s) = length s.
Proof. revert s. induction v as [|[l h] v IH]; intros [|[a b] s]; simpl; try discriminate; auto. Qed.
Lemma length_sum_ends accepted n terms s : sum_ends accepted n terms = Some s -> length s = n.
Proof.
  revert s. induction terms as [|[p b low high] terms IH]; intros s; simpl.
  - intros H. inversion H. apply repeat_length.
  - destruct (find_within accepted p b) as [v|]; [|discriminate].
    destruct (sum_ends accepted n terms) as [z|]; [|discriminate]. specialize (IH _ eq_refl).
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros H. inversion H. do 2 both C. apply Nat.eqb_eq in C.
    rewrite length_add_ends; congruence.
Qed.
Lemma sum_ends_sound ps accepted rho terms s inputs : Forall (holds ps) accepted ->
  sum_ends accepted (inputs_of (part_at ps rho)) terms = Some s -> Forall2 may_stand terms inputs ->
  within s (sum_of_terms ps rho (combine terms inputs)).
Proof.
  intros HA. unfold sum_of_terms. set (n := inputs_of (part_at ps rho)). revert s inputs.
  induction terms as [|[p b low high] terms IH]; intros s inputs; simpl sum_ends.
  - intros H. inversion H. intros _. simpl. rewrite plus_nil_r. unfold zeros. clear.
    induction n; simpl; auto. split; auto. rewrite real_zero. lra.
  - destruct (find_within accepted p b) as [v|] eqn:Ev; [|discriminate].
    destruct (sum_ends accepted n terms) as [z|] eqn:Ez; [|discriminate].
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros H M. inversion H. subst s. clear H.
    inversion M as [|? xs ? inputs' [K F] M']; subst. specialize (IH _ _ eq_refl M'). do 2 both C.
    apply Nat.eqb_eq in C. pose proof (length_sum_ends _ _ _ _ Ez) as Ln.
    assert (Forall (within v) (map (value (part_at ps p)) xs)) as W.
    { apply Forall_map. simpl in F. eapply Forall_impl; [|exact F]. intros x Hx.
      exact (find_within_sound _ _ _ _ _ HA Ev x Hx). }
    simpl in K. simpl flat_map. destruct (sum_within v _ W) as (y & T & L & E). rewrite map_length in T.
    pose proof (within_length _ _ IH) as Lz. simpl vector_sum in *.

    rewrite vector_sum_app, <- plus_assoc, (plus_comm (zeros n)), plus_assoc.
    rewrite E by (etransitivity; [exact Lz|congruence]).
    apply add_ends_within with (k := INR (length xs)); auto; [|congruence]. rewrite INR_IZR_INZ. split;
      apply IZR_le; lia.
Qed.

(** Jumps *)
Lemma largest_abs_above i a : real (fst i) <= a <= real (snd i) -> Rabs a <= real (largest_abs i).
Proof.
  intros [H G]. unfold largest_abs. rewrite real_larger, !real_abs.
  apply Rmax_case_strong; intros; unfold Rabs in *; repeat destruct (Rcase_abs _); lra.
Qed.
Lemma square_below v x : within v x -> square x <= square (reals (map largest_abs v)).
Proof.
  unfold square. revert x. induction v as [|i v IH]; intros [|a x]; simpl; [lra|tauto|destruct i; tauto|].
  destruct i as [l h]. intros [H G]. specialize (IH _ G). pose proof (largest_abs_above (l, h) a H) as L.
  assert (a * a <= real (largest_abs (l, h)) * real (largest_abs (l, h))); [|lra].
  rewrite <- (Rabs_pos_eq (a * a)), Rabs_mult by (apply Rle_0_sqr). pose proof (Rabs_pos a).
  apply Rmult_le_compat; auto.
Qed.
Lemma find_alone_sound ps accepted p n u : Forall (holds ps) accepted -> find_alone accepted p n = Some u ->
  exists moves, forallb (fun m => m) moves = true /\ length moves = n /\ holds ps (Slope_at_most (Alone p) moves []
    u).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|].
  destruct c as [| |[q|] m [|] w| | | | | | | | | | | |];
    simpl find_alone; auto.
  destruct (Nat.eqb_spec p q); simpl; auto. destruct (forallb _ m) eqn:E; auto.
  destruct (Nat.eqb_spec (length m) n); simpl; auto. intros G. inversion G. subst. exists m. auto.
Qed.
Lemma agree_all moves x y : forallb (fun m => m) moves = true -> length x = length moves -> length y = length moves ->
  agree moves x y.
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; try discriminate; auto.
  intros H Hx Hy. both H. split; auto.
Qed.
Lemma norm_difference_of_sum x rest : length x = length rest -> norm (minus (plusR x rest) rest) = norm x.
Proof.
  intros H. f_equal. revert rest H. unfold minus. induction x as [|a x IH]; intros [|b r]; simpl; try discriminate;
    auto.
  intros H. rewrite IH by lia. f_equal. ring.
Qed.
Lemma jump_sound ps accepted p b rho u : Forall (holds ps) accepted -> check_jump ps accepted p b rho u = true ->
  holds ps (Jump_at_most p b rho u).
Proof.
  intros HA. unfold check_jump.
  destruct (find_within _ _ _) as [v|] eqn:Ev; [|discriminate]. destruct (find_alone _ _ _) as [k|] eqn:Ek;
    [|discriminate].
  intros H x rest Hx Hr. do 3 both H. apply Nat.eqb_eq in H. apply real_nonnegative in H1, H2.
    apply at_most_real in H0.
  rewrite !real_mul, real_square in H0. pose proof (find_within_sound _ _ _ _ _ HA Ev x Hx) as W.
  pose proof (within_length _ _ W) as L. destruct (find_alone_sound _ _ _ _ _ HA Ek) as (moves & A & Lm & S).
  assert (length (plusR (value (part_at ps p) x) rest) = inputs_of (part_at ps rho)) as Ls
    by (rewrite length_plus; rewrite ?L; congruence).
  pose proof (S [] (plusR (value (part_at ps p) x) rest) rest (agree_all _ _ _ A ltac:(rewrite Ls;
    auto) ltac:(rewrite Hr; auto)) Ls) as B.
  simpl value_of in B. unfold distance in B. rewrite square_in_one in B. change (sqrt (square ?d)) with (norm d) in B.
  rewrite norm_difference_of_sum in B by congruence. eapply Rle_trans; [exact B|].
  pose proof (square_below _ _ W) as Q. rewrite <- (sqrt_square (real k)) by auto. unfold norm.
  rewrite <- sqrt_mult_alt by nra. apply sqrt_below; auto.
  pose proof (Rmult_le_compat_l (real k * real k) _ _ ltac:(nra) Q). lra.
Qed.
